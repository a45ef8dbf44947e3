"""How much each of some pairs adds to the mutual information of their halves, from nearest neighbours.

Kraskov, Stoegbauer, Grassberger: Estimating mutual information, Physical Review E 69, 2004 (their first estimator,
without the constants, which are the same for all pairs). Where k neighbours are copies of a pair the distance
to them is zero, and pairs at that distance count: Gao, Kannan, Oh, Viswanath: Estimating Mutual Information for
Discrete-Continuous Mixtures, NIPS 2017.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import digamma

from plancurate.tasks.curation.selectors.base import IntArray
from plancurate.tasks.learning.demonstrations import Float32Array, FloatArray


def contributions(x: Float32Array, y: Float32Array, neighbours: Sequence[int]) -> FloatArray:
    """What each pair of rows of x (n, p) and y (n, q) adds (n,), in the mean over numbers of neighbours.

    Two pairs are as far apart as the halves that are further apart, by Euclidean distance. n > max(neighbours).
    """
    of_x, of_y = distances(x), distances(y)
    last = max(neighbours)
    nearest = np.sort(
        np.partition(np.maximum(of_x, of_y), last)[:, : last + 1]
    )  # column 0 is the pair itself
    terms = [digamma(within(of_x, nearest[:, k])) + digamma(within(of_y, nearest[:, k])) for k in neighbours]
    return np.asarray(-np.mean(terms, axis=0))


def distances(points: Float32Array) -> Float32Array:
    """Euclidean distances (n, n) of points (n, d)."""
    squares = (points**2).sum(axis=1)
    found = squares[:, None] + squares - 2 * (points @ points.T)
    np.fill_diagonal(found, 0)
    return np.asarray(np.sqrt(np.maximum(found, 0)))


def within(distance: Float32Array, radius: Float32Array) -> IntArray:
    """How many of the points are nearer (n,) to each than its radius (n,), itself included; at it, where it is 0."""
    count: IntArray = np.count_nonzero(distance < radius[:, None], axis=1)
    alike = radius == 0
    count[alike] = np.count_nonzero(distance[alike] == 0, axis=1)
    return count
