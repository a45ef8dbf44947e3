"""The torques that a motion asks of the joints."""

from __future__ import annotations

import numpy as np

from plancurate.robots.robot import Robot
from plancurate.robots.scene import empty_scene
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.payload import Payload
from plancurate.tasks.candidates.playback import world_of_thread


def joint_torques(
    robot: Robot,
    q: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
    payload: Payload | None = None,
) -> FloatArray:
    """Torques (t, n), N m (N), by inverse dynamics in PyBullet, for states (t, n); gravity and payload included."""
    world = world_of_thread()
    world.build(robot, empty_scene(), payload=payload)
    rows = zip(q.tolist(), velocity.tolist(), acceleration.tolist(), strict=True)
    return np.array([world.torques(*row) for row in rows])
