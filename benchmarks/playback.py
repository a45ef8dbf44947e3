"""Milliseconds of playing a trajectory back: the arm alone first, against a world of everything for each.

    python benchmarks/playback.py [--scenes table free] [--targets 10]

Real, distinct, timed paths of a few planners. Each is simulated as `verify` does, and in a world that is built for it
with all shapes, in turns; the median of each by processor time, in one thread. Joint states, torques and contacts of
both must be equal to the last bit, else the program fails. What remains is PyBullet's own step: printed beside.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections.abc import Callable, Iterator

import numpy as np
from claims import state

from plancurate.robots import Robot, Scene, load_world
from plancurate.tasks.candidates.bullet import bullet
from plancurate.tasks.candidates.plan import plan_candidate
from plancurate.tasks.candidates.playback import Playback, drive, follow, references, rest_to_rest
from plancurate.tasks.candidates.settings import GenerateSettings
from plancurate.tasks.candidates.simulation import World
from plancurate.tasks.candidates.targets import sample_targets
from plancurate.tasks.candidates.time_parameterisation import time_path

PLANNERS = ("RRTConnect", "BKPIECE1", "BiEST", "SBL", "STRIDE", "EST", "LazyPRM", "RRT")
STEPS = 2000
WISHED = 3.0  # times as fast; see docs/performance.md for what it takes
SETTINGS = GenerateSettings()
STEP_S = 1.0 / SETTINGS.verify.frequency_hz


def main() -> None:
    """Measure each scene."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robot", default="h2017")
    parser.add_argument("--scenes", nargs="+", default=("table", "free"))
    parser.add_argument("--targets", type=int, default=10)
    asked = parser.parse_args()
    for name in asked.scenes:
        robot, scene = load_world(asked.robot, name)
        motions = list({q.tobytes(): q for q in timed_paths(robot, scene, asked.targets)}.values())
        if not report(robot, scene, [wanted(q) for q in motions]):
            sys.exit(f"{name}: playbacks differ")


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


def report(robot: Robot, scene: Scene, motions: list[np.ndarray]) -> bool:
    """Play all both ways and print; return whether they are equal."""
    world = World()
    times: dict[str, list[float]] = {"alone": [], "all": []}
    equal = True
    for motion in motions:
        alone, seconds = timed(lambda motion=motion: follow(robot, scene, motion, SETTINGS.verify))
        times["alone"].append(1e3 * seconds)
        everything, seconds = timed(lambda motion=motion: in_world(world, robot, scene, motion))
        times["all"].append(1e3 * seconds)
        equal &= same(alone, everything)
    ours, peer = (statistics.median(times[way]) for way in ("alone", "all"))
    own = 1e3 * step_seconds(robot) * statistics.median(len(motion) - 1 for motion in motions)
    print(
        f"{scene.name}: {len(motions)} distinct trajectories, {peer:.1f} ms each with everything, {ours:.1f} ms as "
        f"verify plays them ({peer / ours:.2f} times as fast), {own:.1f} ms of which are PyBullet's own steps; "
        f"{'all bits equal' if equal else 'NOT equal'}"
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
