"""Milliseconds of a plan and state checks a second of each planner, and plan and simplify on the Panda.

    python benchmarks/planners.py [--scene table] [--problems 8] [--seconds 1.5]

Goals of the problems are found beforehand: what is timed is the native call alone, by processor time in one thread.
Claimed: four million state checks a second of PRMstar. VAMP (Thomason, Kingston and Kavraki 2024) plans for the Panda
as well; its published median, of other problems on another machine, is printed beside RRTConnect's.
"""

from __future__ import annotations

import argparse
import statistics
import time

import numpy as np
from claims import state

from plancurate import native
from plancurate.robots import Robot, Scene, load_world
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.goals import planning_scene, run_goals
from plancurate.tasks.candidates.settings import GenerateSettings, PlanSettings
from plancurate.tasks.candidates.sources.ompl import run_planner
from plancurate.tasks.candidates.targets import sample_targets

CHECKS_WISHED = 4e6  # a second, of PRMstar
VAMP_US = (
    35.0  # its README: median of RRT-Connect on MotionBenchMaker's problems of the Panda, one desktop core
)
SETTINGS = GenerateSettings(plan=PlanSettings(simplification="off"))


def main() -> None:
    """Print a line for each planner, then the Panda's."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scene", default="table")
    parser.add_argument("--problems", type=int, default=8)
    parser.add_argument("--seconds", type=float, default=1.5, help="of each planner")
    asked = parser.parse_args()
    robot, scene, goals = problems("h2017", asked.scene, asked.problems)
    print(f"h2017, scene {scene.name}, {len(goals)} problems: median of a plan, state checks a second")
    for info in native.planners():
        runs = plans(info.name, robot, scene, goals, asked.seconds)
        rate = sum(result.state_checks for result, _ in runs) / sum(seconds for _, seconds in runs)
        print(
            f"  {info.name:12s} {1e3 * statistics.median(s for _, s in runs):9.3f} ms {rate:12,.0f}",
            flush=True,
        )
        if info.name == "PRMstar":
            state("state checks of PRMstar while it plans", "1/s", rate, "limit", CHECKS_WISHED)
    panda(asked.scene, asked.problems, asked.seconds)


def panda(scene_name: str, count: int, seconds: float) -> None:
    """Plan and simplify for the Panda by RRTConnect."""
    robot, scene, goals = problems("panda", scene_name, count)
    runs = [
        (result, s) for result, s in plans("RRTConnect", robot, scene, goals, seconds) if len(result.path)
    ]
    simplified = [timed_simplify(robot, scene, result.path) for result, _ in runs[:200]]
    plan_us, simplify_us = 1e6 * statistics.median(s for _, s in runs), 1e6 * statistics.median(simplified)
    print(
        f"panda, RRTConnect: plan {plan_us:.0f} us, simplify {simplify_us:.0f} us; VAMP published {VAMP_US:g} us"
    )
    state(
        "plan of RRTConnect for the Panda",
        "us",
        plan_us,
        "VAMP, published",
        VAMP_US,
        wished=None,
        less_is_better=True,
    )


def problems(robot_name: str, scene_name: str, count: int) -> tuple[Robot, Scene, list[FloatArray]]:
    """A robot, the scene it plans in, and goals (k, n) of so many targets."""
    robot, scene = load_world(robot_name, scene_name)
    scene = planning_scene(scene, SETTINGS.plan)
    targets = sample_targets(robot, scene, SETTINGS.targets, 0, count)
    found = [run_goals(robot, scene, target, 1, SETTINGS) for target in targets]
    return robot, scene, [goals for goals in found if len(goals)]


def plans(
    planner: str, robot: Robot, scene: Scene, goals: list[FloatArray], seconds: float
) -> list[tuple[native.Result, float]]:
    """Plan to the goals in turn until the time is over; results and their processor time, s."""
    runs: list[tuple[native.Result, float]] = []
    end = time.process_time() + seconds
    while time.process_time() < end:
        start = time.process_time()
        number = len(runs)
        result = run_planner(
            planner, robot, scene, robot.home, goals[number % len(goals)], SETTINGS.plan, number
        )
        runs.append((result, time.process_time() - start))
    return runs


def timed_simplify(robot: Robot, scene: Scene, path: FloatArray) -> float:
    """Processor time of shortening and smoothing a path, s."""
    start = time.process_time()
    native.simplify(
        robot.native, scene.native, np.ascontiguousarray(path), seed=0, resolution=SETTINGS.plan.resolution
    )
    return time.process_time() - start


if __name__ == "__main__":
    main()
