"""Clusters by the shape of the tool's path, compared by dynamic time warping, then k of them for each target."""

from __future__ import annotations

from collections import deque
from dataclasses import replace

import numpy as np
from scipy.cluster.hierarchy import fcluster, linkage

from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.robots.robot import Robot
from plancurate.tasks.curation.pool import FloatArray
from plancurate.tasks.curation.selectors.base import IntArray, Kept, Problem, Settings, selector
from plancurate.tasks.curation.selectors.clusters import cluster_distances
from plancurate.tasks.curation.selectors.ranking import ScoreSettings, composite_scores, random_draws, require
from plancurate.tasks.learning.demonstrations import Float32Array

POINTS = 24
"""Points of a tool path that are compared."""
_MOST_DISTINCT = 12_000  # their distances take 8 n^2 / 2 bytes, twice: 1.2 GB here, and over a minute


@selector("DTW")
def dtw(problem: Problem, settings: Settings) -> Kept:
    """Keep k random trajectories of each target's cluster of similar tool paths (dynamic time warping)."""
    labels = tool_path_clusters(problem)
    return of_nearest_clusters(problem, labels, random_draws(problem, "DTW"))


@selector("DTW_Hybrid", ScoreSettings)
def dtw_hybrid(problem: Problem, settings: ScoreSettings) -> Kept:
    """Keep the k best scores of each target's cluster of similar tool paths (dynamic time warping)."""
    labels = tool_path_clusters(problem)
    scores = composite_scores(problem, settings)
    kept = of_nearest_clusters(problem, labels, scores)
    return replace(kept, score=scores[kept.rows])


def tool_path_clusters(problem: Problem) -> IntArray:
    """Cluster of every candidate (candidates,): as many as targets, or fewer where paths are alike.

    Complete linkage, which heeds the largest distance in a cluster: average linkage puts nearly all in one
    cluster and stray paths in others of their own, and candidates with the same path would count in it.
    """
    with problem.stage("prepare"):
        stored = problem.waypoints(problem.pool.candidates["trajectory_id"].to_pylist())
    with problem.stage("cluster"):
        shapes = np.array([tool_shape(problem.robot, q) for q in stored]).reshape(len(stored), -1)
        distinct, shape_of = np.unique(shapes, axis=0, return_inverse=True)
        if len(distinct) > _MOST_DISTINCT:
            raise PlancurateError(
                f"selector DTW: {len(distinct)} different tool paths need too much memory "
                f"(at most {_MOST_DISTINCT}): use KMeans or DBSCAN, or fewer targets"
            )
        if len(distinct) == 1:
            return np.zeros(len(stored), dtype=np.int64)
        tree = linkage(pairwise_dtw(distinct.reshape(-1, POINTS, 3)), "complete")
        labels = fcluster(tree, problem.pool.n_targets, "maxclust") - 1  # from 1, as fcluster counts
        return np.asarray(labels[shape_of], dtype=np.int64)


def of_nearest_clusters(problem: Problem, labels: IntArray, key: FloatArray) -> Kept:
    """Keep the k lowest keys for each target, of the cluster whose tool positions end nearest to it on average.

    Clusters of path shapes are not groups of targets: some are small, and some are nearest to several targets.
    Where one holds fewer than k candidates that no other target has, the rest comes from the next nearest, and
    so on. So k x targets are kept, each once, with ties by id, unless the pool itself holds fewer (an error).
    """
    targets = problem.pool.n_targets
    require(len(labels), problem.budget * targets, f"the pool (k x {targets} targets are kept)")
    with problem.stage("select"):
        ids = np.array(problem.pool.candidates["trajectory_id"].to_pylist())
        order = np.lexsort((ids, key))
        left = [deque(order[labels[order] == cluster].tolist()) for cluster in range(labels.max() + 1)]
        nearest = cluster_distances(problem.pool, labels).argsort(axis=1, kind="stable")
        kept: list[list[int]] = [[] for _ in range(targets)]
        for choice in nearest.T:  # (targets,): all nearest clusters before the second nearest of any target
            for mine, cluster in zip(kept, choice, strict=True):
                while left[cluster] and len(mine) < problem.budget:
                    mine.append(left[cluster].popleft())
        rows = np.array(kept, dtype=np.int64).ravel()
        rank = np.tile(np.arange(1, problem.budget + 1), targets)
        return Kept(rows, rank=rank, cluster=labels[rows])


def tool_shape(robot: Robot, q: FloatArray) -> Float32Array:
    """Points (POINTS, 3), m, evenly along the tool's path during `q` (m, n): its shape, whatever the speed."""
    tool = native.fk(robot.native, np.ascontiguousarray(q))[:, :3, 3]
    travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(tool, axis=0), axis=1))])
    even = np.linspace(0, travelled[-1], POINTS)
    return np.column_stack([np.interp(even, travelled, axis) for axis in tool.T]).astype(np.float32)


def pairwise_dtw(paths: Float32Array) -> FloatArray:
    """DTW distances of all pairs of `paths` (n, m, 3), in the order of scipy's pdist (n (n - 1) / 2,).

    A distance is the least sum of distances between matched points, when both paths are walked from end to end
    (Sakoe and Chiba 1978, without slope weights or a band).
    """
    reverse = np.ascontiguousarray(paths[:, ::-1].transpose(2, 1, 0))  # (3, m, n)
    n = len(paths)
    distances = np.empty(n * (n - 1) // 2)
    done = 0
    for i in range(n - 1):
        distances[done : done + n - 1 - i] = dtw_to_many(paths[i], reverse[:, :, i + 1 :])
        done += n - 1 - i
    return distances


def dtw_to_many(path: Float32Array, reverse: Float32Array) -> Float32Array:
    """DTW distances (n,) of `path` (m, 3) to n paths, given as (3, m, n) from last point to first.

    The textbook's table of m x m cells, one antidiagonal after another, for all n at once: its cells wait for
    the two before only, and as the one path runs forwards while the others run backwards it is a plain slice.
    """
    _, m, n = reverse.shape
    infinite = np.full((m + 1, n), np.inf, dtype=np.float32)
    before_last, last, now = infinite, infinite.copy(), infinite.copy()  # row r + 1: the cell of point r
    before_last[0] = 0.0
    work = np.empty(3 * m * n, dtype=np.float32)
    points = path.T[:, :, None]
    for diagonal in range(2 * m - 1):
        first, end = max(0, diagonal - m + 1), min(diagonal, m - 1) + 1
        squares = work[: 3 * (end - first) * n].reshape(3, end - first, n)
        offset = m - 1 - diagonal
        np.subtract(points[:, first:end], reverse[:, offset + first : offset + end], out=squares)
        np.square(squares, out=squares)
        cost = squares[0]
        cost += squares[1]
        cost += squares[2]
        np.sqrt(cost, out=cost)
        cells = now[first + 1 : end + 1]
        np.minimum(last[first + 1 : end + 1], last[first:end], out=cells)
        np.minimum(cells, before_last[first:end], out=cells)
        cells += cost
        now[first] = np.inf  # beside the table; rows further off are never read again
        now[end + 1 : end + 2] = np.inf
        before_last, last, now = last, now, before_last
    return last[m]
