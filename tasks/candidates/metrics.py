"""The numbers by which trajectories are compared; a lower one is better for each that enters the score."""

from __future__ import annotations

from typing import TypedDict

import numpy as np

from plancurate import native
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.motions import subdivided
from plancurate.tasks.candidates.polylines import path_length

CLEARANCE_STEP = (
    0.01  # rad (m) between the states of an edge whose clearance is measured, as in checks of edges
)


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
    min_clearance: float | None


def path_metrics(
    robot: Robot, scene: Scene, q: FloatArray, dt: float, target_position: FloatArray
) -> PathMetrics:
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
        min_clearance=min_clearance(robot, scene, q),
    )


def min_clearance(robot: Robot, scene: Scene, q: FloatArray) -> float | None:
    """Smallest distance of the arm from obstacles and floor over samples `q` (m, n) and the edges between them, m.

    A lower bound, to a hundredth of a millimetre where bodies are apart. The arm's distance from itself is left out:
    neighbouring links are always near. None where there is nothing to keep away from.
    """
    nearest = float(
        native.clearance(robot.native_without_pairs, scene.native, subdivided(q, CLEARANCE_STEP)).min()
    )
    return nearest if np.isfinite(nearest) else None


def joint_movement(q: FloatArray) -> float:
    """Sum over steps and joints of abs(q[i, j] - q[i-1, j]) of samples `q` (m, n), rad."""
    return float(np.abs(np.diff(q, axis=0)).sum())


def smoothness(tool: FloatArray, dt: float) -> float:
    """Sum over inner samples of the norm of the acceleration of tool positions `tool` (m, 3), m/s^2."""
    return float(np.linalg.norm(np.diff(tool, n=2, axis=0), axis=1).sum() / dt**2)
