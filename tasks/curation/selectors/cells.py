"""Points of a large pool gathered in cells, so that clustering works on as many cells as places are reached.

The candidates to a target end within micrometres of each other, so a million of them are some ten thousand places.
The cells are those of a grid; each stands for its points with their mean and their total weight, as the leaves of
BIRCH (Zhang et al. 1996) stand for theirs, and distances change by less than a cell's diagonal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from plancurate.tasks.curation.pool import FloatArray
from plancurate.tasks.curation.selectors.base import IntArray


@dataclass(frozen=True, eq=False)
class Cells:
    """Occupied cells of a grid."""

    centre: FloatArray
    """(cells, 3): weighted mean of each cell's points, m."""
    weight: FloatArray
    """(cells,): sum of its points' weights."""
    of_point: IntArray
    """(points,): the cell that each point lies in."""

    def pairs_within(self, distance: float) -> float:
        """About how many pairs of points, ordered and with themselves, lie within a distance, m."""
        tree, count = KDTree(self.centre), np.bincount(self.of_point)
        return float(tree.count_neighbors(tree, distance, weights=(count, count)))


def gathered(points: FloatArray, weight: FloatArray, side: float) -> Cells:
    """Gather points (points, 3), m, of weights (points,) in cells of so large a side, m."""
    corner = np.floor((points - points.min(axis=0)) / side).astype(np.int64)
    order = np.lexsort(corner.T)
    new = np.concatenate([[False], np.any(np.diff(corner[order], axis=0) != 0, axis=1)])
    of_point = np.empty(len(points), dtype=np.int64)
    of_point[order] = np.cumsum(new)
    total: FloatArray = np.bincount(of_point, weight).astype(np.float64)
    sums = [np.bincount(of_point, weight * axis) for axis in points.T]
    return Cells(np.column_stack(sums) / total[:, None], total, of_point)


def at_most(points: FloatArray, weight: FloatArray, side: float, most: int) -> Cells:
    """Gather in the smallest cells, of `side` times a power of two, that are not more than `most`."""
    found = gathered(points, weight, side)
    while len(found.centre) > most:
        side *= 2
        found = gathered(points, weight, side)
    return found


def spread_out(
    points: FloatArray, weight: FloatArray, number: int, random_state: np.random.RandomState
) -> IntArray:
    """Draw `number` of different points (points, 3) with weights (points,): k-means++ (Arthur and Vassilvitskii 2007).

    Each is drawn with a probability by weight and squared distance to those drawn before it, once: scikit-learn's own
    tries 2 + ln k draws for each, in tens of times the time.
    """
    x, y, z = np.ascontiguousarray(points.T)
    drawn: list[int] = []
    apart = np.ones(len(points))
    for share in random_state.uniform(size=number).tolist():
        total = np.cumsum(weight * apart)
        one = min(int(np.searchsorted(total, share * total[-1], side="right")), len(points) - 1)
        squared = (x - x[one]) ** 2 + (y - y[one]) ** 2 + (z - z[one]) ** 2
        apart = np.minimum(apart, squared) if drawn else squared
        drawn.append(one)
    return np.array(drawn)
