"""Whether a trajectory keeps a robot's position, velocity and acceleration limits, and which joint doesn't."""

from __future__ import annotations

import numpy as np

from plancurate.robots.robot import Robot
from plancurate.robots.shapes import FloatArray

POSITION_TOLERANCE = 1e-6  # rad (m): what rounding to float32 may add to a joint at its limit


def limit_problem(robot: Robot, q: FloatArray, dt: float) -> str:
    """Say which joint leaves which limit most, when and by how much; "" for samples `q` (m, n) that keep them.

    Samples follow each other by `dt` s; speeds are their differences, with rest before the first and after the last.
    """
    if problem := position_problem(robot, q):
        return problem
    held = np.concatenate([q[:1], q, q[-1:]])
    speed = np.abs(np.diff(held, axis=0)) / dt / robot.velocity
    change = np.abs(np.diff(held, n=2, axis=0)) / dt**2 / robot.acceleration
    return excess_problem(robot, "velocity", speed, dt) or excess_problem(robot, "acceleration", change, dt)


def position_problem(robot: Robot, q: FloatArray) -> str:
    """Say which joint is farthest outside its position limits, and where; "" for none."""
    beyond = np.maximum(robot.lower - q, q - robot.upper)
    sample, joint = np.unravel_index(beyond.argmax(), beyond.shape)
    if beyond[sample, joint] <= POSITION_TOLERANCE:
        return ""
    return f"{robot.joint_names[joint]} leaves its position limits by {beyond[sample, joint]:.3g} at sample {sample}"


def excess_problem(robot: Robot, limit: str, shares: FloatArray, dt: float) -> str:
    """Say which joint uses more than the whole of a limit; `shares` (steps, n) are used shares of it."""
    step, joint = np.unravel_index(shares.argmax(), shares.shape)
    if shares[step, joint] <= 1:
        return ""
    when = max(0, int(step) - 1) * dt
    return f"{robot.joint_names[joint]} exceeds its {limit} limit {shares[step, joint]:.2f} times after {when:.2f} s"
