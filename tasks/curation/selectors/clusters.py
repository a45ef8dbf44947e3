"""Labels of the candidates by where their tool ends, and which cluster belongs to which target."""

from __future__ import annotations

from functools import cache

import numpy as np
from pydantic import Field
from scipy.spatial.distance import cdist, pdist
from sklearn.cluster import DBSCAN, AgglomerativeClustering, KMeans

from plancurate.errors import PlancurateError
from plancurate.tasks.curation.pool import FloatArray, Pool
from plancurate.tasks.curation.selectors.base import IntArray, Settings

NOISE = -1
_SINGLE_TARGET_EPS_M = 0.05  # with one target there is no distance to be relative to
_SMALLEST_EPS_M = 1e-6
_MOST_FOR_HIERARCHY = 30_000  # its distances take 8 n^2 / 2 bytes: 3.6 GB here


class NumberSettings(Settings):
    """How many clusters: `clusters`, or else `clusters_share` of the number of targets."""

    clusters: int | None = Field(
        None, ge=1, description="number of clusters; by default a share of the targets'"
    )
    clusters_share: float = Field(1.0, gt=0, description="clusters by number of targets")

    def number(self, pool: Pool) -> int:
        """Clusters to make of a pool: at least 1, whether or not it has as many different points."""
        return self.clusters or max(1, round(self.clusters_share * pool.n_targets))


class KMeansSettings(NumberSettings):
    """How many clusters; the best of `n_init` starts."""

    n_init: int = Field(1, ge=1)


class DBSCANSettings(Settings):
    """Neighbours lie within `eps_m`, by default `eps_share` of the smallest distance between two targets."""

    eps_m: float | None = Field(None, gt=0)
    eps_share: float = Field(0.5, gt=0)
    min_samples: int = Field(3, ge=1)


class HierarchicalSettings(NumberSettings):
    """How many clusters, merged bottom up (Ward: least growth of variance)."""


def kmeans_labels(pool: Pool, settings: KMeansSettings, seed: int) -> IntArray:
    """Cluster of every candidate (candidates,)."""
    points = pool.tool_positions()
    clusters = min(settings.number(pool), len(np.unique(points, axis=0)))
    return _integers(KMeans(clusters, n_init=settings.n_init, random_state=seed).fit_predict(points))


def dbscan_labels(pool: Pool, settings: DBSCANSettings, seed: int) -> IntArray:
    """Cluster of every candidate (candidates,), NOISE where it has too few neighbours."""
    eps = settings.eps_m or settings.eps_share * _smallest_distance(pool.target_positions())
    fitted = DBSCAN(eps=max(eps, _SMALLEST_EPS_M), min_samples=settings.min_samples)
    # A trajectory that was planned five times is as dense as five.
    weight = pool.candidates["multiplicity"].to_numpy()
    return _integers(fitted.fit_predict(pool.tool_positions(), sample_weight=weight))


def hierarchical_labels(pool: Pool, settings: HierarchicalSettings, seed: int) -> IntArray:
    """Cluster of every candidate (candidates,)."""
    points = pool.tool_positions()
    if len(points) > _MOST_FOR_HIERARCHY:
        raise PlancurateError(
            f"selector Hierarchical: {len(points)} candidates need too much memory "
            f"(at most {_MOST_FOR_HIERARCHY}): use KMeans or DBSCAN, or fewer targets"
        )
    if len(points) == 1:
        return np.zeros(1, dtype=np.int64)
    clusters = min(settings.number(pool), len(points))
    return _integers(AgglomerativeClustering(clusters).fit_predict(points))


def cluster_of_targets(pool: Pool, labels: IntArray) -> IntArray:
    """The cluster (targets,) whose centroid is nearest to each target; NOISE when there are no clusters."""
    if not np.any(labels != NOISE):
        return np.full(pool.n_targets, NOISE)
    return _integers(cluster_distances(pool, labels).argmin(axis=1))


def cluster_distances(pool: Pool, labels: IntArray) -> FloatArray:
    """Distance (targets, clusters), m, from each target to the mean final tool position of each cluster."""
    found = labels != NOISE
    members = np.bincount(labels[found])
    sums = [np.bincount(labels[found], axis) for axis in pool.tool_positions()[found].T]
    centroids: FloatArray = np.column_stack(sums) / members[:, None]
    return np.asarray(cdist(pool.target_positions(), centroids))


def _smallest_distance(points: FloatArray) -> float:
    if len(points) < 2:
        return 2 * _SINGLE_TARGET_EPS_M
    return float(pdist(points).min())


def _integers(labels: IntArray) -> IntArray:
    return labels.astype(np.int64)


@cache
def warm_up() -> None:
    """Pay what scikit-learn's first calls cost: 0.1 s, for it looks up thread pools."""
    points = np.eye(3)
    KMeans(2, n_init=1, random_state=0).fit_predict(points)
    DBSCAN(0.1).fit_predict(points)
    AgglomerativeClustering(2).fit_predict(points)
