"""The numbers by which trajectories are compared; a lower one is better for each that enters the score."""

from __future__ import annotations

from typing import TypedDict

import numpy as np

from plancurate import native
from plancurate.robots.robot import Robot
from plancurate.robots.shapes import FloatArray


class PathMetrics(TypedDict):
    """Columns of a trajectory's row, named as in the table; `tool_*` is where the tool ends, m."""

    joint_movement: float
    smoothness: float
    path_length: float
    duration: float
    n_waypoints: int
    final_distance: float
    tool_x: float
    tool_y: float
    tool_z: float


def path_metrics(robot: Robot, q: FloatArray, dt: float, target_position: FloatArray) -> PathMetrics:
    """Measure samples `q` (m, n), rad, m >= 1, every `dt` s, that should end at `target_position` (3,), m."""
    tool = native.fk(robot.native, np.ascontiguousarray(q))[:, :3, 3]
    x, y, z = (float(coordinate) for coordinate in tool[-1])
    return PathMetrics(
        joint_movement=joint_movement(q),
        smoothness=smoothness(tool, dt),
        path_length=path_length(tool),
        duration=(len(q) - 1) * dt,
        n_waypoints=len(q),
        final_distance=float(np.linalg.norm(tool[-1] - target_position)),
        tool_x=x,
        tool_y=y,
        tool_z=z,
    )


def joint_movement(q: FloatArray) -> float:
    """Sum over steps and joints of abs(q[i, j] - q[i-1, j]) of samples `q` (m, n), rad."""
    return float(np.abs(np.diff(q, axis=0)).sum())


def path_length(tool: FloatArray) -> float:
    """Sum of the distances between consecutive tool positions `tool` (m, 3), m."""
    return float(np.linalg.norm(np.diff(tool, axis=0), axis=1).sum())


def smoothness(tool: FloatArray, dt: float) -> float:
    """Sum over inner samples of the norm of the acceleration of tool positions `tool` (m, 3), m/s^2."""
    return float(np.linalg.norm(np.diff(tool, n=2, axis=0), axis=1).sum() / dt**2)
