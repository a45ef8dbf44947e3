"""Lengths along polylines: paths in joint space, rad, and those of the tool, m."""

from __future__ import annotations

import numpy as np

from plancurate.robots.shapes import FloatArray


def path_length(points: FloatArray) -> float:
    """Sum of the Euclidean distances between consecutive points (m, d)."""
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def travelled(points: FloatArray) -> FloatArray:
    """Length (m,) of the way from the first of the points (m, d) to each."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def evenly(points: FloatArray, count: int) -> FloatArray:
    """Points (count, d), equally spaced by length along the polyline through points (m, d), both ends included."""
    along = travelled(points)
    wanted = np.linspace(0.0, along[-1], count)
    return np.stack([np.interp(wanted, along, axis) for axis in points.T], axis=1)
