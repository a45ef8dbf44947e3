"""What a pool costs by its size: task runs, parts, bytes, processor seconds, memory, and what that is for larger ones.

    python benchmarks/scale.py [--counts 100 1000] [--targets-per-task 10] [--planners RRTConnect]

Runs the real `generate` on a real Prefect server into an empty home folder for each number of trajectories, in a
process of its own, and fits a line to each cost, of least relative error and with nothing below zero:
cost = fixed + each * trajectories. Processor seconds are those of all processes, the server's too: on a machine with
so many cores and nothing else to do, divide by them. Then it reads the pool as curation does.
"""

from __future__ import annotations

import argparse
import resource
import sqlite3
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import closing
from dataclasses import astuple, dataclass, fields
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import nnls

from plancurate.tasks.lake.home import Home
from plancurate.tasks.lake.status import lake_status

FloatArray = np.ndarray[Any, np.dtype[np.float64]]

RUNS = 10
FORECASTS = (10**5, 10**6, 10**7, 10**8)


@dataclass(frozen=True)
class Cost:
    """What a pool of so many trajectories took."""

    trajectories: int
    tasks: int
    parts: int
    lake_mb: float
    prefect_mb: float
    """Prefect's database."""
    work_s: float
    """Planning, timing and playback, as the rows say."""
    processor_s: float
    wall_s: float
    read_s: float
    """Until the pool is ready to be selected from, in one core."""
    memory_mb: float
    """Most that the flow's process had; the others stay as they are."""


def main() -> None:
    """Measure each number of trajectories and print the fit."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--counts", type=int, nargs="+", default=[100, 1000])
    parser.add_argument("--targets-per-task", type=int, default=10)
    parser.add_argument("--planners", nargs="+", default=["RRTConnect"])
    asked = parser.parse_args()
    show([field.name for field in fields(Cost)])
    costs = []
    with ProcessPoolExecutor(1, get_context("spawn"), max_tasks_per_child=1) as processes:
        for count in asked.counts:
            costs.append(processes.submit(measure, count, asked.targets_per_task, asked.planners).result())
            show(astuple(costs[-1]))
    fixed, each = fit(costs)
    for name, line in {"fixed": fixed, "each": each}.items():
        show((name, *line))
    for count in FORECASTS:
        show((count, *(fixed + each * count)))


def measure(count: int, targets_per_task: int, planners: Sequence[str]) -> Cost:
    """Generate so many trajectories in an empty home, and read them."""
    from plancurate.flows.generate import generate
    from plancurate.flows.server.prefect_server import prefect_server
    from plancurate.tasks.study.config import load_config
    from plancurate.tasks.study.context import open_study
    from plancurate.tasks.study.selections import study_pool

    changes = {
        "name": "scale",
        "scenes": ["table"],
        "n_targets": count // (RUNS * len(planners)),
        "planners": planners,
        "candidates": {"plan": {"runs": RUNS}},
        "targets_per_task": targets_per_task,
    }
    config = load_config("paper", None, changes)
    with tempfile.TemporaryDirectory() as folder:
        home = Home(Path(folder))
        begun = time.perf_counter()
        with prefect_server(home):
            generate(config, str(home.root))
        wall = time.perf_counter() - begun
        own, others = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
        study = open_study(config, home)
        seconds = "SELECT sum(plan_s + timing_s + verify_s) AS seconds FROM trajectories"
        status = lake_status(study.lake)
        return Cost(
            trajectories=status.tables["trajectories"].rows,
            tasks=task_runs(home),
            parts=sum(size.parts for size in status.tables.values()),
            lake_mb=sum(size.bytes for size in status.tables.values()) / 1e6,
            prefect_mb=(home.prefect / "prefect.db").stat().st_size / 1e6,
            work_s=study.lake.sql(seconds)["seconds"][0].as_py(),
            processor_s=own.ru_utime + own.ru_stime + others.ru_utime + others.ru_stime,
            wall_s=wall,
            read_s=study_pool(study, study.pools[0]).load_s,
            memory_mb=own.ru_maxrss / 1000,
        )


def task_runs(home: Home) -> int:
    """How many task runs Prefect recorded."""
    with closing(sqlite3.connect(home.prefect / "prefect.db")) as database:
        return int(database.execute("SELECT count(*) FROM task_run").fetchone()[0])


def fit(costs: Sequence[Cost]) -> tuple[FloatArray, FloatArray]:
    """What each cost is without any trajectory, and for each."""
    measured = np.array([astuple(cost) for cost in costs], float)
    count = measured[:, 0]
    lines = [nnls(np.stack([1 / y, count / y], 1), np.ones(len(y)))[0] for y in measured.T[1:]]
    fixed, each = np.array(lines).T
    return fixed, each


def show(values: Sequence[object]) -> None:
    """Print a line of the table."""
    print(*(f"{v:>13.4g}" if isinstance(v, float) else f"{v:>13}" for v in values), flush=True)


if __name__ == "__main__":
    main()
