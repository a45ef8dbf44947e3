"""Milliseconds of a plan and state checks a second of each planner.

    python benchmarks/planners.py [--scene table] [--problems 8] [--seconds 1.5]

Goals of the problems are found beforehand: what is timed is the native call alone, by processor time in one thread.
Claimed: four million state checks a second of PRMstar.
"""

from __future__ import annotations

import argparse
import statistics
import time

from claims import state

from plancurate import native
from plancurate.robots import Robot, Scene, load_world
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.goals import planning_scene, run_goals
from plancurate.tasks.candidates.settings import GenerateSettings, PlanSettings
from plancurate.tasks.candidates.sources.ompl import run_planner
from plancurate.tasks.candidates.targets import sample_targets

CHECKS_WISHED = 4e6  # a second, of PRMstar
SETTINGS = GenerateSettings(plan=PlanSettings(simplification="off"))


def main() -> None:
    """Print a line for each planner."""
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


if __name__ == "__main__":
    main()
