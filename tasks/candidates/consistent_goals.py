"""Targets with goals that continue each other's, so that neighbouring targets are reached alike.

A policy that is shown one configuration here and another one a few centimetres on learns neither. So a target's goal
continues those of the nearest targets with smaller numbers, and the first target's the start. A target depends on those
before it alone: a pool that grows keeps what it has.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.continued_goals import agreeing_goals, suggested_goals
from plancurate.tasks.candidates.goals import planning_scene
from plancurate.tasks.candidates.settings import GenerateSettings, TargetSettings
from plancurate.tasks.candidates.targets import Target, sample_targets

REVISION = 2  # raise when targets' goals come out otherwise: the ids of pools with goals=consistent hold it
STREAM = 2  # the target's generator for goals around a suggestion; positions and own goals come from others


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
    """The goal (n,) of a target that agrees best with those of the known ones around it."""
    suggested = neighbours_goal(robot, target.position, known)[None]
    seed = (settings.seed, target.target_id, STREAM)
    goals = agreeing_goals(
        robot, scene, target.position[None], suggested, settings, [seed], lambda _: target.goals
    )
    return np.asarray(goals[0])


def neighbours_goal(robot: Robot, position: FloatArray, known: Sequence[Target]) -> FloatArray:
    """The goal (n,) that the known targets around a position (3,), m, suggest; the start where none is known."""
    if not known:
        return robot.home
    places, goals = np.stack([k.position for k in known]), np.stack([k.goals[0] for k in known])
    return np.asarray(suggested_goals(places, goals, position[None])[0])
