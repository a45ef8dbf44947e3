"""Trajectories a minute of the whole `generate`, and where its workers' time goes.

    python benchmarks/generate.py [--targets 20] [--workers 2] [--targets-per-task 1]

Runs the real flow on a real Prefect server into an empty home folder. Of the workers' time, rows of the lake
say what planning, timing and physics took; writing is measured; a process's start ends with its first
trajectory; the rest is orchestration: Prefect, queues between processes, waiting. Claimed: at most 10 %.
"""

from __future__ import annotations

import argparse
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from plancurate.flows.home import Home
from plancurate.tasks.finish_pool import FinishPool
from plancurate.tasks.lake import Lake

if TYPE_CHECKING:
    from plancurate.flows.config import StudyConfig

MOST_ORCHESTRATION = 0.10  # what is claimed
STAGES = {"plan_s": "planning", "timing_s": "timing", "verify_s": "physics"}


@dataclass
class Stopwatch:
    """Seconds that calls took, summed over threads, and when the first of them ended."""

    seconds: float = 0.0
    first_end: float | None = None
    lock: Any = field(default_factory=threading.Lock)

    def around(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Wrap a function so that its calls are timed."""

        def timed(*args: Any, **kwargs: Any) -> Any:
            start = time.perf_counter()
            result = function(*args, **kwargs)
            end = time.perf_counter()
            with self.lock:
                self.seconds += end - start
                self.first_end = self.first_end or end
            return result

        return timed


def main() -> None:
    """Generate into a temporary home and print the shares."""
    from plancurate.flows.config import StudyConfig  # not above: worker processes read this file, too

    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robot", default="h2017")
    parser.add_argument("--scene", default="table")
    parser.add_argument("--targets", type=int, default=20)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--targets-per-task", type=int, default=1)
    arguments = parser.parse_args()
    config = StudyConfig(
        name="benchmark",
        robot=arguments.robot,
        scene=arguments.scene,
        n_targets=arguments.targets,
        workers=arguments.workers,
        targets_per_task=arguments.targets_per_task,
    )
    with tempfile.TemporaryDirectory() as folder:
        rows, wall, starting, writing = generate_timed(config, Home(Path(folder)))
    report(rows, wall, starting, writing, config.workers)


def generate_timed(config: StudyConfig, home: Home) -> tuple[pa.Table, float, float, float]:
    """Run the flow; return its rows, wall time, and the seconds of a start and of all writing."""
    from plancurate.flows.generate import generate
    from plancurate.flows.server import prefect_server

    writing, finishing = Stopwatch(), Stopwatch()
    Lake.write = writing.around(Lake.write)  # type: ignore[method-assign]
    FinishPool.__call__ = finishing.around(FinishPool.__call__)  # type: ignore[method-assign]
    with prefect_server(home):
        start = time.perf_counter()
        generate(config, str(home.root))
        wall = time.perf_counter() - start
    assert finishing.first_end is not None
    rows = Lake(home.lake).connect().sql("SELECT * FROM trajectories").to_arrow_table()
    return rows, wall, finishing.first_end - start, writing.seconds


def report(rows: pa.Table, wall: float, starting: float, writing: float, workers: int) -> None:
    """Print throughput and shares."""
    capacity = workers * (wall - starting)
    shares = {name: sum(rows[column].to_pylist()) / capacity for column, name in STAGES.items()}
    shares["writing"] = writing / capacity
    shares["orchestration"] = 1 - sum(shares.values())
    solved = sum(rows["solved"].to_pylist())
    print(
        f"{solved} of {rows.num_rows} runs solved in {wall:.1f} s with {workers} workers, start {starting:.1f} s"
    )
    print(f"{60 * rows.num_rows / (wall - starting):,.0f} trajectories a minute once started")
    for name, share in shares.items():
        print(f"  {name:14s} {share:6.1%}")
    verdict = "at most" if shares["orchestration"] <= MOST_ORCHESTRATION else "NOT the claimed"
    print(f"orchestration: {verdict} {MOST_ORCHESTRATION:.0%}")


if __name__ == "__main__":
    main()
