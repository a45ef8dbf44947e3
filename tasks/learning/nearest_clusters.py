"""Which cluster of trajectories a target belongs to: the one that ends nearest, in the mean.

The publication speaks of "clusters corresponding to the target point".
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.spatial.distance import cdist

from plancurate import native
from plancurate.robots import Robot

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

REVISION = 1
"""Raise it when targets come to other clusters: the ids of evaluations and a study's key hold it."""


def mean_ends(robot: Robot, paths: Sequence[FloatArray], cluster: IntArray) -> tuple[IntArray, FloatArray]:
    """Return the clusters (k,) and where the tool is at the end of their paths in the mean (k, 3), m.

    `cluster` (paths,) is that of each path (m, n).
    """
    ends = native.fk(robot.native, np.array([path[-1] for path in paths]))[:, :3, 3]
    clusters = np.unique(cluster)
    return clusters, np.array([ends[cluster == one].mean(axis=0) for one in clusters])


def nearest_clusters(position: FloatArray, clusters: IntArray, ends: FloatArray) -> IntArray:
    """Return the cluster (t,) whose mean end (k, 3), m, is nearest to each tool position (t, 3), m."""
    return np.asarray(clusters[cdist(position, ends).argmin(axis=1)])
