"""Draw targets: tool positions, around the start or in a scene's regions, that the robot can reach."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from plancurate import native
from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.robots import Region, colliding_pairs
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.goals import target_goals
from plancurate.tasks.candidates.settings import TargetSettings

CUBE_SHARE = 0.294  # of the robot's reach: half a metre for one of 1.7 m
DISTANCE_SHARE = 0.059  # ditto, ten centimetres


@dataclass(frozen=True, eq=False)
class Target:
    """A tool position (3,), m, and goals (k, n), rad, that reach it within the orientation tolerance."""

    target_id: int
    position: FloatArray
    goals: FloatArray


def sample_targets(
    robot: Robot, scene: Scene, settings: TargetSettings, first: int, count: int
) -> list[Target]:
    """Draw targets `first` to `first + count - 1`; each depends on its number, not on how many are drawn.

    For planning with clearance, `scene` is `planning_scene`'s. Raises PlancurateError when the home configuration
    collides, a region is unknown or no target is reached.
    """
    require_free_home(robot, scene)
    return [sample_target(robot, scene, settings, target_id) for target_id in range(first, first + count)]


def require_free_home(robot: Robot, scene: Scene) -> None:
    """Raise PlancurateError, naming what touches, when the home configuration is in collision."""
    if pairs := colliding_pairs(robot, scene, robot.home):
        raise PlancurateError(
            f"robot {robot.name}: home: collides in scene '{scene.name}' ({', '.join(pairs)}); "
            "another home or scene, or less clearance, is needed"
        )


def sample_target(robot: Robot, scene: Scene, settings: TargetSettings, target_id: int) -> Target:
    """Draw target number `target_id`; the same number and seed mean the same point of any robot's cube."""
    position_rng, ik_rng = np.random.default_rng((settings.seed, target_id)).spawn(2)
    home = native.fk(robot.native, robot.home[None])[0, :3, 3]
    regions = chosen_regions(scene, settings)
    for _ in range(settings.max_tries):
        position = draw_position(home, regions, cube_edge(robot, settings), position_rng)
        if np.linalg.norm(position - home) < least_distance(robot, settings):
            continue
        goals = target_goals(robot, scene, position, settings, ik_rng)
        if len(goals):
            return Target(target_id, position, goals)
    raise PlancurateError(unreached(robot, scene, settings))


def draw_position(
    home: FloatArray, regions: tuple[Region, ...], edge: float, rng: np.random.Generator
) -> FloatArray:
    """A point (3,), m, of one of the regions, each as likely; of the cube around `home` (3,) without any."""
    if not regions:
        return np.asarray(home + rng.uniform(-0.5, 0.5, 3) * edge)
    region = regions[rng.integers(len(regions))]
    return rng.uniform(region.lower, region.upper)


def chosen_regions(scene: Scene, settings: TargetSettings) -> tuple[Region, ...]:
    """The regions asked for, or all of the scene's; UnknownNameError for one that it doesn't have."""
    known = {region.name: region for region in scene.regions}
    for name in settings.regions:
        if name not in known:
            raise UnknownNameError(f"region of scene {scene.name}", name, known)
    return tuple(known[name] for name in settings.regions) or scene.regions


def cube_edge(robot: Robot, settings: TargetSettings) -> float:
    """Edge of the cube around the start's tool position, m."""
    return round(CUBE_SHARE * robot.reach, 2) if settings.range_m is None else settings.range_m


def least_distance(robot: Robot, settings: TargetSettings) -> float:
    """Least distance from the start's tool position, m."""
    if settings.min_distance_m is None:
        return round(DISTANCE_SHARE * robot.reach, 2)
    return settings.min_distance_m


def unreached(robot: Robot, scene: Scene, settings: TargetSettings) -> str:
    """Say what was tried in vain, and what would be right."""
    if regions := chosen_regions(scene, settings):
        where = f"in the regions {', '.join(region.name for region in regions)}"
    else:
        where = f"in a cube of range_m={cube_edge(robot, settings)} around home"
    return (
        f"targets: robot {robot.name} in scene '{scene.name}' reaches none of {settings.max_tries} positions {where}, "
        f"at least min_distance_m={least_distance(robot, settings)} away, with orientation={settings.orientation}; "
        "another range, orientation, home or scene is needed"
    )
