"""Memory over ten thousand planning tasks in one flow, and what of their time is orchestration.

    python benchmarks/memory.py [--targets 1000] [--runs 3] [--goals pose] [--workers 2]

Runs the real flow on a real Prefect server into an empty home folder: ten planners, one target a task, by default with
the settings that a study has. With one run and the nearest goal a task is as small as it gets. Beside the flow, a
thread reads the resident memory of the flow's process, of its largest playback process and of Prefect's server. Growth
is the slope of a line through the second half of the tasks. Orchestration is the processor
time of all of them beyond the tasks' own work, which a busy machine does not change.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from generate import Stopwatch, with_prefect

from plancurate.flows.server.own_server import serving
from plancurate.tasks.candidates.settings import GenerateSettings, PlanSettings
from plancurate.tasks.lake.home import Home

PLANNERS = (
    "RRTConnect", "BKPIECE1", "BiEST", "SBL", "LBKPIECE1", "KPIECE1", "EST", "RRT", "STRIDE", "PDST",
)  # fmt: skip
PAGE_MB = os.sysconf("SC_PAGE_SIZE") / 1e6
TICKS_A_SECOND = os.sysconf("SC_CLK_TCK")
PROCESSES = ("flow", "playback", "server")
EVERY_S, LINES = 2.0, 10


def main() -> None:
    """Generate into a temporary home and print memory as it goes, its growth, and the share of orchestration."""
    from plancurate.flows import generate as stage
    from plancurate.tasks.study.config import StudyConfig

    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--targets", type=int, default=1000)
    parser.add_argument("--runs", type=int, default=PlanSettings().runs, help="runs of each task")
    parser.add_argument("--goals", default=PlanSettings().goals, help="as in a study's candidates.plan.goals")
    parser.add_argument("--workers", type=int, default=2)
    asked = parser.parse_args()
    config = StudyConfig(
        name="benchmark",
        scenes=("free",),
        n_targets=asked.targets,
        planners=PLANNERS,
        candidates=GenerateSettings(plan=PlanSettings(runs=asked.runs, goals=asked.goals)),
        workers=asked.workers,
    )
    work, ended = Stopwatch(clock=time.thread_time), threading.Event()
    stage.make_part = work.around(stage.make_part)
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(1) as beside:
        home = Home(Path(folder))
        watched = beside.submit(watch, home, config.workers, work, ended)
        try:
            with_prefect(config, home)
        finally:
            ended.set()
    report(watched.result())


@dataclass(frozen=True)
class Sample:
    """What is known at a moment: tasks that ended, resident memory and processor time of each kind of process."""

    tasks: int
    at_s: float
    memory_mb: tuple[float, ...]
    used_s: tuple[float, ...]
    work_s: float


def watch(home: Home, workers: int, work: Stopwatch, ended: threading.Event) -> list[Sample]:
    """Look every few seconds while all playback processes are up."""
    samples = []
    while not ended.wait(EVERY_S):
        playback, server = multiprocessing.active_children(), serving(home)
        if work.calls and len(playback) == workers and server:
            pids = [[os.getpid()], [process.pid for process in playback], [server[0]]]
            memory = tuple(max(map(resident, each)) for each in pids)
            used = tuple(sum(map(processor_time, each)) for each in pids)
            samples.append(Sample(work.calls, time.perf_counter(), memory, used, work.seconds))
    return samples


def resident(pid: int) -> float:
    """Resident memory of a process, MB."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * PAGE_MB


def processor_time(pid: int) -> float:
    """Processor time that a process has used, s."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS_A_SECOND


def report(samples: list[Sample]) -> None:
    """Print memory as it went, its growth, and the share of orchestration."""
    print(f"{'tasks':>7s}{'s':>7s}" + "".join(f"{name + ', MB':>14s}" for name in PROCESSES))
    for i in np.linspace(0, len(samples) - 1, LINES).astype(int):
        sample = samples[i]
        columns = "".join(f"{mb:14.1f}" for mb in sample.memory_mb)
        print(f"{sample.tasks:7d}{sample.at_s - samples[0].at_s:7.0f}{columns}")
    late = [sample for sample in samples if sample.tasks > samples[-1].tasks / 2]
    growth = np.polyfit([sample.tasks / 1000 for sample in late], [sample.memory_mb for sample in late], 1)[0]
    for name, megabytes in zip(PROCESSES, growth, strict=True):
        print(f"  {name:10s} grows by {megabytes:6.2f} MB in 1000 tasks")
    flow, playback, server = np.subtract(samples[-1].used_s, samples[0].used_s)
    work = samples[-1].work_s - samples[0].work_s + playback
    print(
        f"orchestration: {1 - work / (flow + playback + server):.1%} of the processor time, "
        f"{(flow + playback + server - work) / (samples[-1].tasks - samples[0].tasks) * 1000:.1f} ms a task"
    )


if __name__ == "__main__":
    main()
