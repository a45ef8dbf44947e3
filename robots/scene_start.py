"""Where a robot starts in a scene: joint positions that the scene names, or those that bring the tool to a point."""

from __future__ import annotations

import numpy as np

from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.robots.collisions import colliding_pairs
from plancurate.robots.inverse_kinematics import draw_ik
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.robots.scene_file import Frame, SceneFile
from plancurate.robots.shapes import FloatArray

STARTS = 512  # of inverse kinematics
CLEARANCE = 0.03  # m that a start by inverse kinematics keeps to obstacles
DIGITS = 6  # of its joint positions, so that a rounding error of some machine makes no other start


def scene_start(
    where: str, content: SceneFile, frame: Frame, robot: Robot, scene: Scene
) -> FloatArray | None:
    """Joint positions (n,) to start from, or None where the scene leaves it to the robot.

    Raises PlancurateError that begins with `where` for a start that the robot can't take.
    """
    named = content.start.get(robot.name) if isinstance(content.start, dict) else content.start
    if named is not None:
        return _checked(f"{where}: start", np.array(named), robot, scene)
    if content.start_tool is None:
        return None
    return _tool_start(f"{where}: start_tool", frame.point(content.start_tool), robot, scene)


def _checked(where: str, start: FloatArray, robot: Robot, scene: Scene) -> FloatArray:
    if len(start) != robot.dof:
        raise PlancurateError(
            f"{where}: {len(start)} joint positions; robot {robot.name} has {robot.dof} joints"
        )
    for name, value, lower, upper in zip(robot.joint_names, start, robot.lower, robot.upper, strict=True):
        if not lower <= value <= upper:
            raise PlancurateError(f"{where}: {name}={value:g} must lie within [{lower:g}, {upper:g}]")
    if pairs := colliding_pairs(robot, scene, start):
        raise PlancurateError(f"{where}: collides ({', '.join(pairs)}); another start is needed")
    return start


def _tool_start(where: str, position: FloatArray, robot: Robot, scene: Scene) -> FloatArray:
    """The solution nearest to home that points the tool along the scene's axis, or as at home without one."""
    home = native.fk(robot.native, robot.home[None])[0, :3, 2]
    axes = np.tile(home if scene.tool_axis is None else scene.tool_axis, (STARTS, 1))
    solutions = draw_ik(robot, scene.grown(CLEARANCE), position, np.random.default_rng(0), STARTS, axes=axes)
    if not len(solutions):
        raise PlancurateError(
            f"{where}: robot {robot.name} can't bring its tool to {np.round(position, 3).tolist()} m, clear of "
            f"obstacles by {CLEARANCE} m; another start_tool or tool_axis is needed"
        )
    nearest = solutions[np.linalg.norm(solutions - robot.home, axis=1).argmin()]
    return np.asarray(np.clip(np.round(nearest, DIGITS), robot.lower, robot.upper))
