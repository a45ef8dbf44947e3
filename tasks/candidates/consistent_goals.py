"""Goal configurations that continue a neighbouring target's, so that neighbouring targets are reached alike.

A policy that is shown one configuration here and another one a few centimetres on learns neither. So each target's
goals are the solutions nearest to those of the nearest target with a smaller number, and the first target's those
nearest to the start. A target depends on those before it alone: a pool that grows keeps what it has.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from plancurate.robots import continue_ik, representatives
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.goals import SAME, planning_scene, snapped, tool_draws, tool_rotation
from plancurate.tasks.candidates.path_classes import GOAL_RADIUS
from plancurate.tasks.candidates.settings import GenerateSettings
from plancurate.tasks.candidates.targets import Target, sample_targets

STARTS = 64  # of inverse kinematics around a neighbour's goal
SPREAD = 0.5  # rad (m) of each joint around it
STREAM = 2  # the target's generator for these; its position and its own goals come from others


def draw_targets(
    robot: Robot,
    scene: Scene,
    settings: GenerateSettings,
    first: int,
    count: int,
    earlier: Sequence[Target] = (),
) -> list[Target]:
    """Draw targets `first` to `first + count - 1` of a pool with goals as its settings want them.

    For goals=consistent `earlier` holds all targets before the first, as drawn. Raises PlancurateError as
    `sample_targets` does.
    """
    kept = planning_scene(scene, settings.plan)
    drawn = sample_targets(robot, kept, settings.targets, first, count)
    if settings.plan.goals != "consistent":
        return drawn
    known = [target for target in earlier if target.target_id < first]
    for target in drawn:
        known.append(replace(target, goals=consistent_goals(robot, kept, target, known, settings)))
    return known[len(known) - count :]


def consistent_goals(
    robot: Robot, scene: Scene, target: Target, known: Sequence[Target], settings: GenerateSettings
) -> FloatArray:
    """Up to `goal_draws` goals (k, n) of a target, of one class, nearest first to the one that they continue."""
    reference = neighbours_goal(robot, target.position, known)
    goals = np.concatenate([target.goals, continued(robot, scene, target, reference, settings)])
    nearest_first = goals[np.linalg.norm(goals - reference, axis=1).argsort(kind="stable")]
    alike = nearest_first[np.abs(nearest_first - nearest_first[0]).max(axis=1) <= GOAL_RADIUS / 2]
    return snapped(representatives(alike, SAME)[: settings.plan.goal_draws], target.goals)


def neighbours_goal(robot: Robot, position: FloatArray, known: Sequence[Target]) -> FloatArray:
    """The first goal (n,) of the known target nearest to a position (3,), m; the start where none is known."""
    if not known:
        return robot.home
    nearest = min(known, key=lambda other: float(np.linalg.norm(other.position - position)))
    return np.asarray(nearest.goals[0])


def continued(
    robot: Robot, scene: Scene, target: Target, reference: FloatArray, settings: GenerateSettings
) -> FloatArray:
    """Free goals (k, n) of a target within its tolerance that starts around the configuration `reference` lead to."""
    rng = np.random.default_rng((settings.targets.seed, target.target_id, STREAM))
    around = reference + rng.uniform(-SPREAD, SPREAD, (STARTS, robot.dof))
    starts = np.clip(around, robot.lower, robot.upper)
    held = tool_draws(tool_rotation(robot, scene), settings.targets, rng, STARTS)
    return continue_ik(robot, scene, target.position, starts, **held)
