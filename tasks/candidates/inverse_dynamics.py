"""The torques that a motion asks of the joints."""

from __future__ import annotations

import numpy as np

from plancurate.robots.robot import Robot
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.payload import Payload
from plancurate.tasks.candidates.playback import lone_arm_of_thread

STEP_S = 1.0 / 240.0  # of a simulation that stands still: playback's usual one, so that both share their arm


def joint_torques(
    robot: Robot,
    q: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
    payload: Payload | None = None,
) -> FloatArray:
    """Torques (t, n), N m (N), by inverse dynamics in PyBullet, for states (t, n); gravity and payload included."""
    world = lone_arm_of_thread(robot, STEP_S, payload)
    rows = zip(q.tolist(), velocity.tolist(), acceleration.tolist(), strict=True)
    return np.array([world.torques(*row) for row in rows])
