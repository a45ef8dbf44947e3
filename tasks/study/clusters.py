"""A policy for each cluster of a selection: which clusters there are, and which tests belong to each."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.spatial.distance import cdist

from plancurate import native
from plancurate.tasks.curation.pool import FloatArray
from plancurate.tasks.study.context import StudyContext
from plancurate.tasks.study.demonstrations import selected_waypoints
from plancurate.tasks.study.scenes import IntArray
from plancurate.tasks.study.selections import WantedSelection, make_selection


def learnt_clusters(study: StudyContext, selection: WantedSelection) -> list[int | None]:
    """Return the clusters that networks learn from apart; None stands for all that is kept, by one network."""
    if study.config.one_policy_a == "selection":
        return [None]
    return sorted(set(make_selection(study, selection).kept["cluster"].drop_null().to_pylist())) or [None]


def nearest_clusters(study: StudyContext, selection: WantedSelection, position: FloatArray) -> IntArray:
    """Return the cluster (k,) whose kept trajectories end nearest, in the mean, to each tool position (k, 3), m.

    The publication speaks of "clusters corresponding to the target point".
    """
    clusters, ends = mean_ends(study, selection)
    return np.asarray(clusters[cdist(position, ends).argmin(axis=1)])


@lru_cache(maxsize=8)  # asked for once a cluster, from all waypoints of the selection
def mean_ends(study: StudyContext, selection: WantedSelection) -> tuple[IntArray, FloatArray]:
    """Return a selection's clusters (k,), and where its kept trajectories of each end in the mean (k, 3), m."""
    pool, made = study.pool(selection.pool), make_selection(study, selection)
    last = np.array([path[-1] for path in selected_waypoints(study, made, pool.partition)])
    ends, of_end = native.fk(pool.robot.native, last)[:, :3, 3], made.kept["cluster"].to_numpy()
    clusters = np.unique(of_end)
    return clusters, np.array([ends[of_end == one].mean(axis=0) for one in clusters])
