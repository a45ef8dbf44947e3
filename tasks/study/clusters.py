"""A policy for each cluster of a selection: which clusters there are, and which tests belong to each."""

from __future__ import annotations

from functools import lru_cache

from plancurate.tasks.learning.nearest_clusters import FloatArray, IntArray, mean_ends, nearest_clusters
from plancurate.tasks.study.context import StudyContext
from plancurate.tasks.study.demonstrations import selected_waypoints
from plancurate.tasks.study.selections import WantedSelection, make_selection


@lru_cache(maxsize=4096)  # asked for again for every policy and seed
def learnt_clusters(study: StudyContext, selection: WantedSelection) -> tuple[int | None, ...]:
    """Return the clusters that networks learn from apart; None stands for all that is kept, by one network."""
    if study.config.one_policy_a == "selection":
        return (None,)
    clusters = make_selection(study, selection).kept["cluster"].drop_null().to_pylist()
    return tuple(sorted(set(clusters))) or (None,)


def answering_clusters(study: StudyContext, selection: WantedSelection, position: FloatArray) -> IntArray:
    """Return the cluster (t,) of a selection whose network answers a target at each tool position (t, 3), m."""
    return nearest_clusters(position, *_mean_ends(study, selection))


@lru_cache(maxsize=8)  # asked for once a cluster, from all waypoints of the selection
def _mean_ends(study: StudyContext, selection: WantedSelection) -> tuple[IntArray, FloatArray]:
    pool, made = study.pool(selection.pool), make_selection(study, selection)
    paths = selected_waypoints(study, made, pool.partition)
    return mean_ends(pool.robot, paths, made.kept["cluster"].to_numpy())
