"""Labels of the candidates by where their tool ends, and which cluster belongs to which target.

Pools up to a stated size are clustered point by point; in larger ones, what lies in one small cell is one point.
scikit-learn is imported where it clusters: loading it takes a second, and most processes of a study don't cluster.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from pydantic import Field
from scipy.spatial import KDTree
from scipy.spatial.distance import cdist

from plancurate.tasks.curation.pool import FloatArray, Pool
from plancurate.tasks.curation.selectors.base import IntArray, Settings
from plancurate.tasks.curation.selectors.cells import Cells, at_most, gathered, spread_out

NOISE = -1
_SINGLE_TARGET_EPS_M = 0.05  # with one target there is no distance to be relative to
_SMALLEST_EPS_M = 1e-6
_CELL_M = 1e-4  # of large pools: far below a millimetre, by which a candidate may miss its target
_MOST_POINTS_AND_MEANS = 5 * 10**7  # k-means looks at every pair in each of its steps: 10 s here
_MOST_NEIGHBOURS = 5 * 10**7  # DBSCAN lists all pairs of neighbours: 0.4 GB here
_EPS_IN_CELLS = 20
_MOST_FOR_HIERARCHY = 30_000  # its distances take 8 n^2 / 2 bytes: 3.6 GB here
_MOST_CELLS_FOR_HIERARCHY = 15_000  # 0.9 GB, beside a pool of a million candidates
_TARGETS_AT_ONCE = 1000


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

    def samples(self, pool: Pool) -> int:
        """Candidates that make a place dense: as given; else 3, or fewer where no target of the pool has three.

        A target's candidates end at one place; where each has one alone, as recorded episodes may, all would be noise.
        """
        if "min_samples" in self.model_fields_set:
            return self.min_samples
        candidates = pool.candidates
        of_target = np.bincount(candidates["target_id"].to_numpy(), candidates["multiplicity"].to_numpy())
        return min(self.min_samples, int(of_target.max()))


class HierarchicalSettings(NumberSettings):
    """How many clusters, merged bottom up (Ward: least growth of variance)."""


def kmeans_labels(pool: Pool, settings: KMeansSettings, seed: int) -> IntArray:
    """Cluster of every candidate (candidates,)."""
    from sklearn.cluster import KMeans

    points = pool.tool_positions()
    if len(points) * settings.number(pool) > _MOST_POINTS_AND_MEANS:
        return _kmeans_of_cells(gathered(points, np.ones(len(points)), _CELL_M), pool, settings, seed)
    clusters = min(settings.number(pool), len(np.unique(points, axis=0)))
    return _integers(KMeans(clusters, n_init=settings.n_init, random_state=seed).fit_predict(points))


def _kmeans_of_cells(cells: Cells, pool: Pool, settings: KMeansSettings, seed: int) -> IntArray:
    """Cluster of every candidate by k-means of weighted cells."""
    from sklearn.cluster import KMeans

    clusters = min(settings.number(pool), len(cells.centre))

    def starts(points: FloatArray, number: int, random_state: np.random.RandomState) -> FloatArray:
        return points[spread_out(points, cells.weight, number, random_state)]

    fitted = KMeans(clusters, init=starts, n_init=settings.n_init, random_state=seed)
    return _integers(fitted.fit_predict(cells.centre, sample_weight=cells.weight))[cells.of_point]


def dbscan_labels(pool: Pool, settings: DBSCANSettings, seed: int) -> IntArray:
    """Cluster of every candidate (candidates,), NOISE where it has too few neighbours.

    In a large pool, neighbours may be farther or nearer than said by a tenth: cells are a twentieth as large.
    """
    from sklearn.cluster import DBSCAN

    points = pool.tool_positions()
    eps = settings.eps_m or settings.eps_share * _smallest_distance(pool.target_positions())
    eps = max(eps, _SMALLEST_EPS_M)
    fitted = DBSCAN(eps=eps, min_samples=settings.samples(pool))
    # A trajectory that was planned five times is as dense as five.
    weight = pool.candidates["multiplicity"].to_numpy()
    cells = gathered(points, weight, eps / _EPS_IN_CELLS)
    if cells.pairs_within(eps) <= _MOST_NEIGHBOURS:
        return _integers(fitted.fit_predict(points, sample_weight=weight))
    return _integers(fitted.fit_predict(cells.centre, sample_weight=cells.weight))[cells.of_point]


def hierarchical_labels(pool: Pool, settings: HierarchicalSettings, seed: int) -> IntArray:
    """Cluster of every candidate (candidates,)."""
    points = pool.tool_positions()
    if len(points) <= _MOST_FOR_HIERARCHY:
        return _ward(points, settings.number(pool))
    cells = at_most(points, np.ones(len(points)), _CELL_M, _MOST_CELLS_FOR_HIERARCHY)
    return _ward(cells.centre, settings.number(pool))[cells.of_point]


def _ward(points: FloatArray, number: int) -> IntArray:
    from sklearn.cluster import AgglomerativeClustering

    if len(points) == 1:
        return np.zeros(1, dtype=np.int64)
    return _integers(AgglomerativeClustering(min(number, len(points))).fit_predict(points))


def cluster_of_targets(pool: Pool, labels: IntArray) -> IntArray:
    """The cluster (targets,) whose centroid is nearest to each target; NOISE when there are no clusters."""
    if not np.any(labels != NOISE):
        return np.full(pool.n_targets, NOISE)
    found = labels != NOISE
    members = np.bincount(labels[found])
    sums = [np.bincount(labels[found], axis) for axis in pool.tool_positions()[found].T]
    centroids: FloatArray = np.column_stack(sums) / members[:, None]
    targets = pool.target_positions()
    parts = np.split(targets, range(_TARGETS_AT_ONCE, len(targets), _TARGETS_AT_ONCE))
    return _integers(np.concatenate([cdist(part, centroids).argmin(axis=1) for part in parts]))


def _smallest_distance(points: FloatArray) -> float:
    if len(points) < 2:
        return 2 * _SINGLE_TARGET_EPS_M
    distance, _ = KDTree(points).query(points, k=2)
    return float(distance[:, 1].min())


def _integers(labels: IntArray) -> IntArray:
    return labels.astype(np.int64)


@cache
def warm_up() -> None:
    """Pay what scikit-learn and its first calls cost: a second, and 0.1 s, for it looks up thread pools."""
    from sklearn.cluster import DBSCAN, AgglomerativeClustering, KMeans

    points = np.eye(3)
    KMeans(2, n_init=1, random_state=0).fit_predict(points)
    DBSCAN(0.1).fit_predict(points)
    AgglomerativeClustering(2).fit_predict(points)
