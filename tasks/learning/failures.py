"""Why rollouts failed, in words: told once a failed trial, never a step."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from plancurate import native
from plancurate.robots import colliding_pairs
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene

FloatArray = npt.NDArray[np.float64]
COLLIDED, LIMITS, LOST = "collided", "limits", "lost"


def collision_detail(robot: Robot, scene: Scene, q0: FloatArray, q1: FloatArray, resolution: float) -> str:
    """Name what a move from q0 to q1 (n,) meets first, as "link_4 and table"; `resolution` as in `edge_is_free`."""
    count = max(1, int(np.ceil(np.abs(q1 - q0).max() / resolution)))
    t = np.arange(count + 1)[:, None] / count
    states = (1 - t) * q0 + t * q1
    free = native.is_free(robot.native, scene.native, states)
    return next(iter(colliding_pairs(robot, scene, states[free.argmin()])), "")


def limits_detail(robot: Robot, q0: FloatArray, q1: FloatArray, dt: float) -> str:
    """Name the joint that a move from q0 to q1 (n,) within `dt` s takes farthest over a limit, and which limit.

    A position limit comes before a velocity limit: "joint_2 position". Angles that are no numbers are positions.
    """
    with np.errstate(invalid="ignore"):
        beyond = np.nan_to_num(np.maximum(robot.lower - q1, q1 - robot.upper), nan=np.inf)
        if (beyond > 0).any():
            return f"{robot.joint_names[beyond.argmax()]} position"
        share = np.abs(q1 - q0) / (dt * robot.velocity)
    return f"{robot.joint_names[share.argmax()]} velocity"
