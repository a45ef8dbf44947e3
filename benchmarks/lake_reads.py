"""What it costs that a lake of 5000 trajectories is verified while it is read.

    python benchmarks/lake_reads.py

Each job runs in a lake that this process has not looked at yet. Printed: its processor time without any look at
the parts; what comparing each part's SHA-256 adds; what checking each part's Parquet footer would add instead,
which tells a foreign or newer part but no changed byte. Parts first as a study writes them (one for each planner
and target), then merged by `compact`. Claimed: a study's reading of its pool costs at most 10 % more verified.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from unittest import mock

import numpy as np
import pyarrow as pa
from claims import state

from plancurate.tasks.curation.pool import load_pool, load_waypoints
from plancurate.tasks.lake import inspection
from plancurate.tasks.lake.compact import compact
from plancurate.tasks.lake.schema import table
from plancurate.tasks.lake.store import Lake

POOL = {"robot": "h2017", "scene": "free", "pool": "0123456789ab"}
PLANNERS, TARGETS, RUNS, REPEATS = [f"P{number}" for number in range(10)], 50, 10, 5
CLAIMED = 0.10


class Stopwatch:
    """Processor time spent inside one function."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def around(self, function: Callable[..., object]) -> Callable[..., object]:
        """The same function, timed."""

        def timed(*arguments: object) -> object:
            start = time.process_time()
            try:
                return function(*arguments)
            finally:
                self.seconds += time.process_time() - start

        return timed


def main() -> None:
    """Measure all jobs on both layouts and say whether the claim holds."""
    with tempfile.TemporaryDirectory() as folder:
        lake = Lake(Path(folder) / "lake")
        fill(lake)
        shares = [measure(lake.root, f"{len(PLANNERS) * TARGETS} parts")]
        for planner in PLANNERS:
            for _ in range(2):
                compact(lake, "trajectories", {**POOL, "planner": planner}, {}, grace_s=0)
        shares.append(measure(lake.root, f"{len(PLANNERS)} merged parts"))
    print(f"\nreading a pool costs {max(shares):.1%} more verified; claimed: at most {CLAIMED:.0%}")
    state("reading a pool verified", "share", max(shares), "limit", CLAIMED, less_is_better=True)
    sys.exit(max(shares) > CLAIMED)


def measure(root: Path, layout: str) -> float:
    """Print the seconds of each job; return the share that is claimed."""
    print(f"\n{layout:24s}{'unverified':>12s}{'+ SHA-256':>18s}{'or + footers':>18s}")
    shares = {}
    for name, job in JOBS.items():
        runs = [timed(job, root) for _ in range(REPEATS)]
        alone, hashing, footers = (min(values) for values in zip(*runs, strict=True))
        shares[name] = hashing / alone
        told = "".join(f"{seconds:9.3f} s {seconds / alone:5.0%}" for seconds in (hashing, footers))
        print(f"{name:24s}{alone:10.3f} s {told}")
    return shares["pool and waypoints"]


def timed(job: Callable[[Lake], object], root: Path) -> tuple[float, float, float]:
    """Seconds of a job without any look at the parts, of comparing hashes, of checking footers."""
    hashing, footers = Stopwatch(), Stopwatch()
    checks = {
        "difference": hashing.around(inspection.difference),
        "_misfit": footers.around(inspection._misfit),
    }
    with mock.patch.multiple(inspection, written_as=lambda *_: "nobody", **checks):
        lake = Lake(root)
        start = time.process_time()
        job(lake)
        return (
            time.process_time() - start - hashing.seconds - footers.seconds,
            hashing.seconds,
            footers.seconds,
        )


def fill(lake: Lake) -> None:
    """Write targets and trajectories of random waypoints."""
    rng = np.random.default_rng(0)
    targets = [
        {"target_id": i, "x": 0.5, "y": 0.1, "z": 0.6, "goals": [[0.1] * 6] * 8} for i in range(TARGETS)
    ]
    lake.write("targets", POOL, "all", pa.Table.from_pylist(targets, table("targets").schema), {})
    for planner in PLANNERS:
        for target in range(TARGETS):
            rows = [trajectory(planner, target, run, rng) for run in range(RUNS)]
            part = pa.Table.from_pylist(rows, table("trajectories").schema)
            lake.write("trajectories", {**POOL, "planner": planner}, f"{target:04d}", part, {})


def trajectory(planner: str, target: int, run: int, rng: np.random.Generator) -> dict[str, object]:
    """A row of `trajectories`, every column filled."""
    schema = table("trajectories").schema
    row: dict[str, object] = {field.name: FILLING.get(field.type) for field in schema}
    waypoints = rng.normal(0, 0.02, (int(rng.integers(40, 160)), 6)).cumsum(axis=0).astype(np.float32)
    own = {"trajectory_id": f"t{target:04d}-{planner}-r{run}", "target_id": target, "run": run}
    return row | own | {"n_waypoints": len(waypoints), "q": waypoints.tolist()}


def read_pool(lake: Lake) -> None:
    """Read what curation and training read: all candidates, and waypoints of a fifth of them."""
    pool = load_pool(lake, POOL)
    load_waypoints(lake, POOL, pool.candidates["trajectory_id"].to_pylist()[::5])


FILLING: dict[pa.DataType, object] = {
    pa.string(): "text", pa.int32(): 1, pa.int64(): 1, pa.bool_(): True, pa.float64(): 0.5,
}  # fmt: skip
JOBS: dict[str, Callable[[Lake], object]] = {
    "pool and waypoints": read_pool,
    "summary of planners": lambda lake: lake.sql(
        "SELECT planner, avg(plan_s), avg(joint_movement) FROM trajectories GROUP BY planner"
    ),
    "count(*)": lambda lake: lake.sql("SELECT count(*) FROM trajectories"),
    "every row and waypoint": lambda lake: lake.read("trajectories", {}),
}


if __name__ == "__main__":
    main()
