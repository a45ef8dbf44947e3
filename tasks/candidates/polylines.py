"""Lengths along polylines: paths in joint space, rad, and those of the tool, m."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from plancurate.robots.shapes import FloatArray

AT_ONCE = 1000  # polylines, which keeps what is computed of them in the cache


def path_length(points: FloatArray) -> float:
    """Sum of the Euclidean distances between consecutive points (m, d)."""
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def travelled(points: FloatArray) -> FloatArray:
    """Length (m,) of the way from the first of the points (m, d) to each."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def evenly(points: FloatArray, count: int) -> FloatArray:
    """Points (count, d), equally spaced by length along the polyline through points (m, d), both ends included."""
    found: FloatArray = evenly_each([points], count)[0]
    return found


def evenly_each(polylines: Sequence[FloatArray], count: int) -> FloatArray:
    """Points (polylines, count, d), as `evenly` of each polyline (m, d), d in common; those of equal m at once."""
    lengths = np.array([len(points) for points in polylines])
    found = np.empty((len(polylines), count, polylines[0].shape[1]))
    for length in np.unique(lengths).tolist():
        rows = np.flatnonzero(lengths == length)
        for some in np.split(rows, range(AT_ONCE, len(rows), AT_ONCE)):
            found[some] = _evenly(np.stack([polylines[row] for row in some]), count)
    return found


def _evenly(points: FloatArray, count: int) -> FloatArray:
    """Points (b, count, d) along polylines through points (b, m, d); with the bits of np.linspace and np.interp."""
    step = np.diff(points, axis=1)
    length = np.linalg.norm(step, axis=2)
    along = np.concatenate([np.zeros((len(points), 1)), np.cumsum(length, axis=1)], axis=1)
    wanted = np.arange(count) * (along[:, -1:] / (count - 1))
    wanted[:, -1] = along[:, -1]
    before = np.count_nonzero(along[:, None, :] <= wanted[:, :, None], axis=2) - 1
    last = before == points.shape[1] - 1
    row = np.arange(len(points))[:, None]
    before = np.where(last, 0, before)
    slope = step[row, before] / np.where(last, 1.0, np.diff(along, axis=1)[row, before])[:, :, None]
    found = slope * (wanted - along[row, before])[:, :, None] + points[row, before]
    return np.where(last[:, :, None], points[:, -1:], found)
