"""Draw targets: tool positions around the home position that the robot can reach without a collision."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.robots import colliding_pairs, solve_ik
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.settings import TargetSettings


@dataclass(frozen=True, eq=False)
class Target:
    """A tool position (3,), m, and the goals (k, n), rad, that reach it in the home orientation."""

    target_id: int
    position: FloatArray
    goals: FloatArray


def sample_targets(
    robot: Robot, scene: Scene, settings: TargetSettings, first: int, count: int
) -> list[Target]:
    """Draw targets `first` to `first + count - 1`; each depends on its number, not on how many are drawn.

    Raises PlancurateError when the home configuration collides or a target can't be placed.
    """
    require_free_home(robot, scene)
    return [sample_target(robot, scene, settings, target_id) for target_id in range(first, first + count)]


def require_free_home(robot: Robot, scene: Scene) -> None:
    """Raise PlancurateError, naming what touches, when the home configuration is in collision."""
    if pairs := colliding_pairs(robot, scene, robot.home):
        raise PlancurateError(
            f"robot {robot.name}: home: collides in scene '{scene.name}' ({', '.join(pairs)}); "
            "another home or scene is needed"
        )


def sample_target(robot: Robot, scene: Scene, settings: TargetSettings, target_id: int) -> Target:
    """Draw target number `target_id`; the same number and seed mean the same point of any robot's cube."""
    position_rng, ik_rng = np.random.default_rng((settings.seed, target_id)).spawn(2)
    home = native.fk(robot.native, robot.home[None])[0]
    for _ in range(settings.max_tries):
        offset = position_rng.uniform(-0.5, 0.5, 3) * settings.range_m
        if np.linalg.norm(offset) < settings.min_distance_m:
            continue
        goals = solve_ik(robot, scene, home[:3, 3] + offset, home[:3, :3], ik_rng)
        if len(goals):
            return Target(target_id, home[:3, 3] + offset, goals)
    raise PlancurateError(
        f"targets: robot {robot.name} in scene '{scene.name}' reaches none of {settings.max_tries} positions "
        f"in a cube of range_m={settings.range_m} around home, at least min_distance_m="
        f"{settings.min_distance_m} away; another range, home or scene is needed"
    )
