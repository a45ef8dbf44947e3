"""Trajectories resampled at equal joint steps: a state asks for the same action however fast it was passed.

A step is measured along the path, as the Euclidean norm over all joints. Every step is as long as asked for but the
last one, which is what is left: so an action depends on the path ahead alone, not on where the motion began.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from plancurate.tasks.candidates.polylines import travelled

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

_ROUNDING = 1e-9
"""Share of a step below which what is left is none."""


def resampled(q: FloatArray, step: float) -> FloatArray:
    """Waypoints (k, n) on the polyline through q (m, n), rad, `step` rad apart along it; both ends are kept."""
    along = travelled(q)
    points = marks(float(along[-1]), step)
    return np.column_stack([np.interp(points, along, joint) for joint in q.T])


def resampled_steps(q: FloatArray, kept: IntArray, step: float) -> IntArray:
    """Waypoints of `resampled(q, step)` that stand for the kept waypoints (k,) of q (m, n), in order.

    One does if the waypoint nearest to it along the path is kept, or if it is the nearest to a kept one; the last
    one, where the robot is to hold, only if the last one is kept.
    """
    along = travelled(q)
    points = marks(float(along[-1]), step)
    stands = np.isin(np.arange(len(q)), kept)[_nearest(along, points)]
    before_last = np.minimum(_nearest(points, along[kept]), max(len(points) - 2, 0))
    stands[np.where(kept < len(q) - 1, before_last, len(points) - 1)] = True
    return np.flatnonzero(stands)


def marks(length: float, step: float) -> FloatArray:
    """Distances (k,) along a path of that length at which waypoints lie: every step, and its end."""
    count = max(0, int(np.ceil(length / step - _ROUNDING)))
    return np.append(np.arange(count) * step, length)


def _nearest(grid: FloatArray, values: FloatArray) -> IntArray:
    """For each value (k,) the number of the nearest in the ascending grid (m,)."""
    return np.searchsorted((grid[1:] + grid[:-1]) / 2, values, side="right")
