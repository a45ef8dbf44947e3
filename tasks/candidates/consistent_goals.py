"""Targets with goals that continue each other's, so that neighbouring targets are reached alike.

A policy that is shown one configuration here and another one a few centimetres on learns neither. So a target's goal
continues those of the nearest targets with smaller numbers, and the first target's the start. A target depends on those
before it alone: a pool that grows keeps what it has.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from plancurate.robots import continue_ik
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.continued_goals import continued_goals, suggested_goals
from plancurate.tasks.candidates.goals import planning_scene, tool_draws, tool_rotation
from plancurate.tasks.candidates.settings import GenerateSettings, TargetSettings
from plancurate.tasks.candidates.targets import Target, sample_targets

REVISION = 2  # raise when targets' goals come out otherwise: the ids of pools with goals=consistent hold it
STARTS = 64  # of inverse kinematics around a reference, where it can't be continued as it is
SPREAD = 0.5  # rad (m) of each joint around it, for the farthest of these
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
        goal = consistent_goal(robot, kept, target, known, settings.targets)
        known.append(replace(target, goals=goal[None]))
    return known[len(known) - count :]


def consistent_goal(
    robot: Robot, scene: Scene, target: Target, known: Sequence[Target], settings: TargetSettings
) -> FloatArray:
    """The goal (n,) of a target that continues those of the known ones around it; else the solution nearest to them."""
    reference = neighbours_goal(robot, target.position, known)
    goals, found = continued_goals(robot, scene, target.position[None], reference[None], settings)
    if found[0]:
        return goals[0]
    goals = np.concatenate([around(robot, scene, target, reference, settings), target.goals])
    return np.asarray(goals[np.linalg.norm(goals - reference, axis=1).argmin()])


def neighbours_goal(robot: Robot, position: FloatArray, known: Sequence[Target]) -> FloatArray:
    """The goal (n,) that the known targets around a position (3,), m, suggest; the start where none is known."""
    if not known:
        return robot.home
    places, goals = np.stack([k.position for k in known]), np.stack([k.goals[0] for k in known])
    return suggested_goals(places, goals, position[None])[0]


def around(
    robot: Robot, scene: Scene, target: Target, reference: FloatArray, settings: TargetSettings
) -> FloatArray:
    """Free goals (k, n) of a target within its tolerance that starts nearer and farther around `reference` lead to."""
    rng = np.random.default_rng((settings.seed, target.target_id, STREAM))
    spread = SPREAD * np.linspace(0, 1, STARTS)[:, None]
    starts = np.clip(reference + spread * rng.uniform(-1, 1, (STARTS, robot.dof)), robot.lower, robot.upper)
    held = tool_draws(tool_rotation(robot, scene), settings, rng, STARTS)
    return continue_ik(robot, scene, target.position, starts, **held)
