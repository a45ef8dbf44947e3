"""Clusters, then k of each target's cluster: at random, or the best scores (the hybrids)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from plancurate.errors import PlancurateError
from plancurate.tasks.curation.pool import Pool
from plancurate.tasks.curation.selectors.base import IntArray, Kept, Problem, Settings, add
from plancurate.tasks.curation.selectors.clusters import (
    NOISE,
    DBSCANSettings,
    HierarchicalSettings,
    KMeansSettings,
    cluster_of_targets,
    dbscan_labels,
    hierarchical_labels,
    kmeans_labels,
    warm_up,
)
from plancurate.tasks.curation.selectors.ranking import (
    ScoreSettings,
    composite_scores,
    lowest_of_groups,
    random_draws,
)

Labels = Callable[[Pool, Any, int], IntArray]


class KMeansHybridSettings(KMeansSettings, ScoreSettings):
    """Clusters and score."""


class DBSCANHybridSettings(DBSCANSettings, ScoreSettings):
    """Clusters and score."""


class HierarchicalHybridSettings(HierarchicalSettings, ScoreSettings):
    """Clusters and score."""


def clusters_in_use(problem: Problem, labels: Labels, settings: Settings) -> IntArray:
    """Cluster of every candidate (candidates,), NOISE unless it is the cluster of some target."""
    with problem.stage("cluster"):
        found = labels(problem.pool, settings, problem.seed)
        of_target = cluster_of_targets(problem.pool, found)
        if NOISE in of_target:
            raise PlancurateError(
                "selector DBSCAN: every candidate is noise; raise eps_m or lower min_samples"
            )
        return np.where(np.isin(found, of_target), found, NOISE)


def _plain(name: str, labels: Labels) -> Callable[[Problem, Settings], Kept]:
    def choose(problem: Problem, settings: Settings) -> Kept:
        clusters = clusters_in_use(problem, labels, settings)
        kept = lowest_of_groups(problem, clusters, random_draws(problem, name), problem.budget)
        return replace(kept, cluster=clusters[kept.rows])

    return choose


def _hybrid(labels: Labels, sign: int) -> Callable[[Problem, ScoreSettings], Kept]:
    """Keep the lowest scores of each cluster in use where `sign` is 1, the highest where it is -1."""

    def choose(problem: Problem, settings: ScoreSettings) -> Kept:
        clusters = clusters_in_use(problem, labels, settings)
        scores = composite_scores(problem, settings)
        kept = lowest_of_groups(problem, clusters, sign * scores, problem.budget)
        return replace(kept, cluster=clusters[kept.rows], score=scores[kept.rows])

    return choose


for _name, _labels, _settings, _hybrid_settings in (
    ("KMeans", kmeans_labels, KMeansSettings, KMeansHybridSettings),
    ("DBSCAN", dbscan_labels, DBSCANSettings, DBSCANHybridSettings),
    ("Hierarchical", hierarchical_labels, HierarchicalSettings, HierarchicalHybridSettings),
):
    _of = f"of each target's {_name} cluster"
    add(_name, _plain(_name, _labels), _settings, f"Keep k random trajectories {_of}.", warm_up=warm_up)
    add(
        f"{_name}_Hybrid",
        _hybrid(_labels, 1),
        _hybrid_settings,
        f"Keep the k best scores {_of}.",
        warm_up=warm_up,
        revision=2,
    )
    add(
        f"{_name}_Hybrid_Worst",
        _hybrid(_labels, -1),
        _hybrid_settings,
        f"Keep the k worst scores {_of}: the other end, as a control.",
        warm_up=warm_up,
    )
