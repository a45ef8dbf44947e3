"""Milliseconds of playing a trajectory back: the arm alone first, against a world of everything for each.

    python benchmarks/playback.py [--scenes table free] [--targets 10] [--lake FOLDER]

Real, distinct, timed paths of a few planners, or with `--lake` those of all its pools. Each is simulated as `verify`
does, and in a world that is built for it with all shapes, in turns; the median of each by processor time, in one
thread. Joint states, torques and contacts of both must be equal to the last bit, and the verdict of the latter must be
that of every row of the lake, else the program fails. What remains is PyBullet's own step: printed beside.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from claims import state

from plancurate.robots import Robot, Scene, load_world
from plancurate.tasks.candidates.bullet import bullet
from plancurate.tasks.candidates.plan import plan_candidate
from plancurate.tasks.candidates.playback import (
    Playback,
    Verification,
    drive,
    follow,
    judge,
    references,
    rest_to_rest,
)
from plancurate.tasks.candidates.settings import GenerateSettings
from plancurate.tasks.candidates.simulation import World
from plancurate.tasks.candidates.targets import sample_targets
from plancurate.tasks.candidates.time_parameterisation import time_path
from plancurate.tasks.curation.pool import waypoint_arrays
from plancurate.tasks.lake.store import Lake

PLANNERS = ("RRTConnect", "BKPIECE1", "BiEST", "SBL", "STRIDE", "EST", "LazyPRM", "RRT")
VERDICT = [
    *(
        "verified",
        "max_tracking_error_rad",
        "final_tracking_error_m",
        "contacts",
        "saturated_share",
        "verify_reason",
    ),
]
STEPS = 2000
WISHED = 3.0  # times as fast; see docs/performance.md for what it takes
SETTINGS = GenerateSettings()
STEP_S = 1.0 / SETTINGS.verify.frequency_hz


@dataclass(frozen=True, eq=False)
class Motion:
    """Samples `q` (m, n), rad, and what a lake says of each row that holds them."""

    q: np.ndarray
    said: list[Verification]


def main() -> None:
    """Measure each scene, or each pool."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robot", default="h2017")
    parser.add_argument("--scenes", nargs="+", default=("table", "free"))
    parser.add_argument("--targets", type=int, default=10)
    parser.add_argument("--lake", type=Path, help="play what all its pools hold instead")
    asked = parser.parse_args()
    for robot, scene, motions in recorded(Lake(asked.lake)) if asked.lake else planned(asked):
        if not report(robot, scene, motions):
            sys.exit(f"{scene.name}: playbacks differ")


def planned(asked: argparse.Namespace) -> Iterator[tuple[Robot, Scene, list[Motion]]]:
    """Each scene and the distinct trajectories planned in it now."""
    for name in asked.scenes:
        robot, scene = load_world(asked.robot, name)
        distinct = {q.tobytes(): q for q in timed_paths(robot, scene, asked.targets)}
        yield robot, scene, [Motion(q, []) for q in distinct.values()]


def recorded(lake: Lake) -> Iterator[tuple[Robot, Scene, list[Motion]]]:
    """The world of each pool and its distinct trajectories."""
    pools = lake.sql("SELECT DISTINCT robot, scene, pool FROM trajectories ORDER BY ALL")
    for pool in pools.to_pylist():
        rows = lake.read("trajectories", pool)
        rows = rows.filter(rows["solved"])
        motions: dict[bytes, Motion] = {}
        for q, said in zip(waypoint_arrays(rows["q"]), rows.select(VERDICT).to_pylist(), strict=True):
            motions.setdefault(q.tobytes(), Motion(q, [])).said.append(Verification(*said.values()))
        yield *load_world(pool["robot"], pool["scene"]), list(motions.values())


def timed_paths(robot: Robot, scene: Scene, count: int) -> Iterator[np.ndarray]:
    """Samples (m, n) of the trajectories of all planners and runs to so many targets."""
    for target in sample_targets(robot, scene, SETTINGS.targets, 0, count):
        for planner in PLANNERS:
            for run in range(SETTINGS.plan.runs):
                planned = plan_candidate(robot, scene, target, planner, run, SETTINGS)
                if planned.status == "exact":
                    timed = time_path(robot, scene, planned.path, SETTINGS.timing)
                    if not timed.reason:
                        yield timed.q


def wanted(q: np.ndarray) -> np.ndarray:
    """References (s+1, n) of the samples."""
    dt = SETTINGS.timing.dt
    path = rest_to_rest(np.arange(len(q)) * dt, q, dt)
    return references(path, 0.0, (len(q) - 1) * dt, SETTINGS.verify)


def report(robot: Robot, scene: Scene, motions: list[Motion]) -> bool:
    """Play all both ways and print; return whether they are equal, and equal to what was said of them."""
    world = World()
    times: dict[str, list[float]] = {"alone": [], "all": []}
    equal, refused = True, 0
    for motion in motions:
        steps = wanted(motion.q)
        alone, seconds = timed(lambda steps=steps: follow(robot, scene, steps, SETTINGS.verify))
        times["alone"].append(1e3 * seconds)
        everything, seconds = timed(lambda steps=steps: in_world(world, robot, scene, steps))
        times["all"].append(1e3 * seconds)
        verdict = judge(robot, motion.q, SETTINGS.timing.dt, everything, SETTINGS.verify)
        equal &= same(alone, everything) and all(said == verdict for said in motion.said)
        refused += not verdict.verified
    ours, peer = (statistics.median(times[way]) for way in ("alone", "all"))
    own = 1e3 * step_seconds(robot) * statistics.median(len(wanted(motion.q)) - 1 for motion in motions)
    rows = sum(len(motion.said) for motion in motions)
    print(
        f"{scene.name}: {len(motions)} distinct trajectories{f' of {rows} rows' if rows else ''}, {refused} refused; "
        f"{peer:.1f} ms each with everything, {ours:.1f} ms as verify plays them ({peer / ours:.2f} times as fast), "
        f"{own:.1f} ms of which are PyBullet's own steps; {'all bits equal' if equal else 'NOT equal'}",
        flush=True,
    )
    what = f"playback of a trajectory, scene {scene.name}"
    state(what, "ms", ours, "every shape, built anew", peer, wished=WISHED, less_is_better=True)
    return equal


def timed(play: Callable[[], Playback]) -> tuple[Playback, float]:
    """What a call gives, and its processor time, s."""
    start = time.process_time()
    played = play()
    return played, time.process_time() - start


def in_world(world: World, robot: Robot, scene: Scene, motion: np.ndarray) -> Playback:
    """Simulate with all shapes, from nothing."""
    world.build(robot, scene, STEP_S)
    return drive(world, robot, motion, SETTINGS.verify)


def same(one: Playback, other: Playback) -> bool:
    """Whether two playbacks are equal to the last bit."""
    arrays = one.q.tobytes() == other.q.tobytes() and one.torque.tobytes() == other.torque.tobytes()
    return arrays and one.touching == other.touching


def step_seconds(robot: Robot) -> float:
    """Processor time of one step of PyBullet with the arm alone."""
    world = World()
    world.build_alone(robot, STEP_S)
    world.place(robot.home.tolist())
    rounds = []
    for _ in range(5):
        start = time.process_time()
        for _ in range(STEPS):
            bullet.stepSimulation(world.client)
        rounds.append((time.process_time() - start) / STEPS)
    return min(rounds)


if __name__ == "__main__":
    main()
