"""Trajectories a minute of the whole `generate`, and where its time goes.

    python benchmarks/generate.py [--targets 16] [--workers 2] [--repeats 3]

Runs the real flow on a real Prefect server into an empty home folder, and the same steps for the same parts in
plain threads into another: what the flow takes longer is orchestration. Rows of the lake say what planning,
timing and physics took, writing is measured. Time counts from the first finished trajectory, when all processes
are up; both ways take turns and the fastest run of each counts, since a busy machine only ever adds to them.
Done for the grouping of the `paper` preset (claimed: orchestration at most 10 %) and for one target a task,
where each task run of Prefect stands beside a twentieth of a second of work.
"""

from __future__ import annotations

import argparse
import tempfile
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from claims import state

from plancurate.tasks.candidates.postprocess_pool import PostprocessPool, shared_pool
from plancurate.tasks.lake.home import Home
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study.candidates import make_part, missing_parts, study_targets
from plancurate.tasks.study.context import open_study

if TYPE_CHECKING:
    from plancurate.tasks.study.config import StudyConfig

MOST_ORCHESTRATION = 0.10  # what is claimed
STAGES = {"plan_s": "planning", "timing_s": "timing", "verify_s": "physics"}


@dataclass
class Stopwatch:
    """Seconds that calls took, summed over threads, how many there were, and when the first of them ended."""

    seconds: float = 0.0
    calls: int = 0
    clock: Callable[[], float] = time.perf_counter
    first_end: float | None = None
    lock: Any = field(default_factory=threading.Lock)

    def around(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Wrap a function so that its calls are timed."""

        def timed(*args: Any, **kwargs: Any) -> Any:
            start = self.clock()
            result = function(*args, **kwargs)
            end = self.clock()
            with self.lock:
                self.seconds, self.calls = self.seconds + end - start, self.calls + 1
                self.first_end = self.first_end or end
            return result

        return timed


@dataclass(frozen=True)
class Measured:
    """One way of generating: trajectories, seconds once started, and worker seconds by stage."""

    runs: int
    solved: int
    wall_s: float
    stages_s: dict[str, float]


def main() -> None:
    """Generate into temporary homes with and without Prefect, and print throughput and shares."""
    # Not above: worker processes read this file, too.
    from plancurate.tasks.study.config import StudyConfig, load_config

    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robot", default="h2017")
    parser.add_argument("--scene", default="table")
    parser.add_argument("--targets", type=int, default=16)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--repeats", type=int, default=3)
    asked = parser.parse_args()
    for grouping in (load_config("paper", None, {}).targets_per_task, 1):
        config = StudyConfig(
            name="benchmark",
            robot=asked.robot,
            scenes=(asked.scene,),
            n_targets=asked.targets,
            workers=asked.workers,
            targets_per_task=grouping,
        )
        print(f"targets in a task: {grouping}")
        pairs = [(measure(with_prefect, config), measure(in_threads, config)) for _ in range(asked.repeats)]
        flow, plain = (min(runs, key=lambda run: run.wall_s) for runs in zip(*pairs, strict=True))
        report(flow, plain, config.workers)
        rates = [60 * run.runs / run.wall_s for run in (flow, plain)]
        what, least = f"trajectories by tasks of {grouping} targets", 1 - MOST_ORCHESTRATION
        state(what, "1/min", rates[0], "without Prefect", rates[1], wished=least)


def with_prefect(config: StudyConfig, home: Home) -> None:
    """Run the flow as the command line does."""
    from plancurate.flows.generate import generate
    from plancurate.flows.server.prefect_server import prefect_server

    with prefect_server(home):
        generate(config, str(home.root))


def in_threads(config: StudyConfig, home: Home) -> None:
    """Run the flow's own steps without Prefect, as many at once."""
    study = open_study(config, home)
    pool = study.pools[0]
    parts = missing_parts(study, pool, study_targets(study, pool))
    with shared_pool(config.workers), ThreadPoolExecutor(2 * config.workers) as threads:
        list(threads.map(partial(make_part, study), parts))


def measure(run: Callable[[StudyConfig, Home], None], config: StudyConfig) -> Measured:
    """Run into an empty home and read what came of it."""
    writing, finishing, write, call = Stopwatch(), Stopwatch(), Lake.write, PostprocessPool.__call__
    Lake.write = writing.around(write)  # type: ignore[method-assign]
    PostprocessPool.__call__ = finishing.around(call)  # type: ignore[method-assign]
    try:
        with tempfile.TemporaryDirectory() as folder:
            home = Home(Path(folder))
            run(config, home)
            with Lake(home.lake).connect() as connection:
                rows = connection.sql("SELECT * EXCLUDE (q) FROM trajectories").to_arrow_table()
            parts = (home.lake / "trajectories").rglob("part-0*.parquet")
            end = max(part.stat().st_mtime for part in parts)
    finally:
        Lake.write, PostprocessPool.__call__ = write, call  # type: ignore[method-assign]
    assert finishing.first_end is not None
    began = time.time() - (time.perf_counter() - finishing.first_end)
    stages = {name: sum(rows[column].to_pylist()) for column, name in STAGES.items()}
    solved = sum(rows["solved"].to_pylist())
    return Measured(rows.num_rows, solved, end - began, stages | {"writing": writing.seconds})


def report(flow: Measured, plain: Measured, workers: int) -> None:
    """Print throughput and shares."""
    orchestration = 1 - plain.wall_s / flow.wall_s
    print(f"{flow.solved} of {flow.runs} runs solved in {flow.wall_s:.1f} s with {workers} workers")
    print(
        f"{60 * flow.runs / flow.wall_s:,.0f} trajectories a minute, "
        f"{60 * plain.runs / plain.wall_s:,.0f} without Prefect"
    )
    work = sum(flow.stages_s.values())
    for name, seconds in flow.stages_s.items():
        print(f"  {name:14s} {seconds / work * (1 - orchestration):6.1%}")
    print(f"  {'orchestration':14s} {orchestration:6.1%}")
    verdict = "at most" if orchestration <= MOST_ORCHESTRATION else "more than"
    print(f"orchestration: {verdict} {MOST_ORCHESTRATION:.0%}")


if __name__ == "__main__":
    main()
