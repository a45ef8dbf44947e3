"""What a planner, and a straight line, make of a tested tool position."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.goals import drawn_goals, target_goals
from plancurate.tasks.candidates.scene_report import is_hard
from plancurate.tasks.candidates.settings import GenerateSettings, TargetSettings
from plancurate.tasks.candidates.sources.ompl import run_planner

PLANNER = "RRTConnect"
SOLUTION_STARTS = 64  # of inverse kinematics, for goals that are chosen from
SOLUTION_STREAM = 1  # the test's generator that draws them; `reach` draws from another


@dataclass(frozen=True)
class Reach:
    """How a tool position can be reached from the robot's home."""

    planned: bool
    """Whether inverse kinematics has a free goal within the orientation tolerance and the planner reaches one."""
    hard: bool
    """Whether the straight joint line to the goal nearest to home is not free, or there is no goal."""


def reach(
    robot: Robot, scene: Scene, position: FloatArray, settings: GenerateSettings, seed: tuple[int, ...]
) -> Reach:
    """Look for goals of a tool position (3,), m, and plan to them; `seed` decides all that is drawn."""
    goals = target_goals(robot, scene, position, settings.targets, np.random.default_rng(seed))
    if not len(goals):
        return Reach(planned=False, hard=True)
    raw = settings.plan.model_copy(update={"simplification": "off"})
    result = run_planner(PLANNER, robot, scene, robot.home, goals, raw, seed[0])
    return Reach(planned=result.status == "exact", hard=is_hard(robot, scene, goals, settings))


def goal_solutions(
    robot: Robot, scene: Scene, position: FloatArray, settings: TargetSettings, seed: tuple[int, ...]
) -> FloatArray:
    """Free goals (k, n) of a tool position (3,), m, to choose from: all of an exact pose, else drawn ones."""
    rng = np.random.default_rng((*seed, SOLUTION_STREAM))
    if settings.orientation == "exact":
        return target_goals(robot, scene, position, settings, rng)
    return drawn_goals(robot, scene, position, settings, rng, SOLUTION_STARTS)
