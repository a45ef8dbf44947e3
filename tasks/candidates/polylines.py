"""Lengths along polylines: paths in joint space, rad, and those of the tool, m."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from plancurate.robots.shapes import FloatArray, IntArray

AT_ONCE = 250  # polylines, which keeps what is computed of them in the cache


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
    """Points (polylines, count, d), as `evenly` of each polyline (m, d); those of about equal m at once."""
    lengths = np.array([len(points) for points in polylines])
    found = np.empty((len(polylines), count, polylines[0].shape[1]))
    by_length = np.argsort(lengths, kind="stable")
    for some in np.split(by_length, range(AT_ONCE, len(by_length), AT_ONCE)):
        found[some] = _evenly(_padded([polylines[row] for row in some], lengths[some]), count)
    return found


def _padded(polylines: Sequence[FloatArray], lengths: IntArray) -> FloatArray:
    """Polylines (b, m, d) of one length m, the longest's: the others stay at their end, and are as long as before."""
    step = np.minimum(np.arange(lengths.max()), lengths[:, None] - 1)
    padded: FloatArray = np.concatenate(polylines)[(np.cumsum(lengths) - lengths)[:, None] + step]
    return padded


def _evenly(points: FloatArray, count: int) -> FloatArray:
    """Points (b, count, d) along polylines through points (b, m, d); with the bits of np.linspace and np.interp."""
    number, most, axes = points.shape
    step = np.diff(points, axis=1)
    along = np.zeros((number, most))
    np.cumsum(np.linalg.norm(step, axis=2), axis=1, out=along[:, 1:])
    wanted = np.arange(count) * (along[:, -1:] / (count - 1))
    wanted[:, -1] = along[:, -1]
    before = np.zeros(wanted.shape, dtype=np.min_scalar_type(most))
    for passed in along.T[1:]:
        before += passed[:, None] <= wanted
    last = before == most - 1
    row = np.arange(number)[:, None]
    at = (np.where(last, 0, before) + row * most).ravel()  # rows of all points, which `take` finds fastest
    with np.errstate(invalid="ignore"):  # of a step that goes nowhere, which no wanted length lies in
        slope = np.divide(step, np.diff(along, axis=1)[:, :, None])
    found = slope.reshape(-1, axes).take(at - np.repeat(row, count), axis=0)
    found *= (wanted.ravel() - along.ravel().take(at))[:, None]
    found += points.reshape(-1, axes).take(at, axis=0)
    return np.where(last[:, :, None], points[:, -1:], found.reshape(number, count, axes))
