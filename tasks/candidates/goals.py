"""Goal configurations: which joint positions count as having reached a target."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from plancurate import native
from plancurate.robots import draw_ik, representatives, solve_ik
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.settings import GenerateSettings, PlanSettings, TargetSettings

if TYPE_CHECKING:
    from plancurate.tasks.candidates.targets import Target

TARGET_STARTS = 256  # of inverse kinematics for a target whose goals form a continuum
MOST_GOALS = 32  # kept of those, the nearest to the start first
RUN_STARTS = 32  # a round, for the goals that a run draws for itself
RUN_ROUNDS = 8
SAME = 1e-6  # rad (m); drawn goals nearer than this are one
POSE_STREAM = 1  # the run's generator that draws goals; sources draw from others


def planning_scene(scene: Scene, settings: PlanSettings) -> Scene:
    """The scene as planners see it: obstacles grown by the clearance that paths keep to them."""
    return scene.grown(settings.clearance_m)


def target_goals(
    robot: Robot, scene: Scene, position: FloatArray, settings: TargetSettings, rng: np.random.Generator
) -> FloatArray:
    """Free goals (k, n) of a tool position (3,), m: all of them, or representatives where they form a continuum."""
    rotation = tool_rotation(robot, scene)
    if settings.orientation == "exact":
        return solve_ik(robot, scene, position, rotation, rng)
    drawn = drawn_goals(robot, scene, position, settings, rng, TARGET_STARTS)
    nearest_first = np.argsort(np.linalg.norm(drawn - robot.home, axis=1), kind="stable")
    return representatives(drawn[nearest_first])[:MOST_GOALS]


def run_goals(
    robot: Robot, scene: Scene, target: Target, seed: int, settings: GenerateSettings
) -> FloatArray:
    """The goals (k, n) of the run with this seed, free in `scene`; (0, n) when there is none."""
    if settings.plan.goals == "pose":
        return pose_goals(robot, scene, target, seed, settings)
    goals = target.goals[native.is_free(robot.native, scene.native, target.goals)]
    if settings.plan.goals == "nearest" and len(goals):
        return nearest_goal(robot, goals)[None]
    return goals


def nearest_goal(robot: Robot, goals: FloatArray) -> FloatArray:
    """The one (n,) of the goals (k, n), k >= 1, that is nearest to the start in joint space."""
    return np.asarray(goals[np.linalg.norm(goals - robot.home, axis=1).argmin()])


def pose_goals(
    robot: Robot, scene: Scene, target: Target, seed: int, settings: GenerateSettings
) -> FloatArray:
    """Up to `goal_draws` goals (k, n) that a run draws: tool orientation in the tolerance, solution at random.

    One that is drawn twice is kept once, and one that the target has is that very goal: two runs that draw it
    must not differ by a rounding error.
    """
    rng = np.random.default_rng((seed, POSE_STREAM))
    goals = np.empty((0, robot.dof))
    for _ in range(RUN_ROUNDS):
        drawn = drawn_goals(robot, scene, target.position, settings.targets, rng, RUN_STARTS)
        goals = np.concatenate([goals, drawn])[: settings.plan.goal_draws]
        if len(goals) == settings.plan.goal_draws:
            break
    return snapped(representatives(goals, SAME), target.goals)


def snapped(goals: FloatArray, known: FloatArray) -> FloatArray:
    """Goals (k, n) with those that are as good as equal to a known one (m, n) replaced by it."""
    if not len(known):
        return goals
    apart = np.abs(goals[:, None] - known).max(axis=2)
    return np.where((apart.min(axis=1) < SAME)[:, None], known[apart.argmin(axis=1)], goals)


def drawn_goals(
    robot: Robot,
    scene: Scene,
    position: FloatArray,
    settings: TargetSettings,
    rng: np.random.Generator,
    starts: int,
) -> FloatArray:
    """Free goals (k, n), in random order, that as many random starts lead to."""
    return draw_ik(
        robot, scene, position, rng, starts, **tool_draws(tool_rotation(robot, scene), settings, rng, starts)
    )


def tool_rotation(robot: Robot, scene: Scene) -> FloatArray:
    """Orientation (3, 3) of the tool at the scene's targets: as at home, turned to the scene's axis if it has one."""
    home = native.fk(robot.native, robot.home[None])[0, :3, :3]
    return home if scene.tool_axis is None else turn_between(home[:, 2], scene.tool_axis) @ home


def tool_draws(
    rotation: FloatArray, settings: TargetSettings, rng: np.random.Generator, count: int
) -> dict[str, Any]:
    """What `draw_ik` holds the tool to within the tolerance: a rotation (3, 3), axes (count, 3) or nothing."""
    if settings.orientation == "exact":
        return {"rotation": rotation}
    if settings.orientation == "yaw_free":
        return {"axes": np.tile(rotation[:, 2], (count, 1))}
    if settings.orientation == "cone":
        return {"axes": cone_axes(rotation, np.radians(settings.cone_deg), rng, count)}
    return {}


def cone_axes(rotation: FloatArray, half_angle: float, rng: np.random.Generator, count: int) -> FloatArray:
    """Directions (count, 3), uniform over the cap of the sphere around the z axis of `rotation`."""
    z = rng.uniform(np.cos(half_angle), 1.0, count)
    turn = rng.uniform(0.0, 2 * np.pi, count)
    side = np.sqrt(1.0 - z**2)
    return np.asarray(np.stack([side * np.cos(turn), side * np.sin(turn), z], axis=1) @ rotation.T)


def turn_between(a: FloatArray, b: FloatArray) -> FloatArray:
    """The smallest turn (3, 3) that brings unit vector `a` onto unit vector `b`."""
    axis, cosine = np.cross(a, b), float(a @ b)
    length = float(np.linalg.norm(axis))
    if length < 1e-9:  # the same way, or opposite: then any axis across will do
        across = np.cross(a, np.eye(3)[np.abs(a).argmin()])
        return (
            np.eye(3)
            if cosine > 0
            else Rotation.from_rotvec(np.pi * across / np.linalg.norm(across)).as_matrix()
        )
    return np.asarray(Rotation.from_rotvec(np.arctan2(length, cosine) * axis / length).as_matrix())
