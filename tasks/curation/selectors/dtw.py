"""Groups of each target's tool paths, compared by dynamic time warping, then k of the largest group."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pydantic import Field
from scipy.cluster.hierarchy import fcluster, linkage

from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.robots.robot import Robot
from plancurate.tasks.candidates.polylines import evenly
from plancurate.tasks.curation.pool import FloatArray
from plancurate.tasks.curation.selectors.base import IntArray, Kept, Problem, Settings, selector
from plancurate.tasks.curation.selectors.ranking import (
    ScoreSettings,
    composite_scores,
    lowest_of_scope,
    random_draws,
    tie_draws,
)
from plancurate.tasks.curation.selectors.transitions import target_rows
from plancurate.tasks.learning.demonstrations import Float32Array

POINTS = 24
"""Points of a tool path that are compared."""
_MOST_OF_A_TARGET = 12_000  # their distances take 8 n^2 / 2 bytes, twice: 1.2 GB here, and over a minute


class DTWSettings(Settings):
    """How finely the paths to a target are told apart."""

    groups: int = Field(
        2, ge=1, description="groups of similar tool paths that a target's candidates are cut into"
    )


class DTWHybridSettings(DTWSettings, ScoreSettings):
    """Groups and score."""


@selector("DTW", DTWSettings, revision=2)
def dtw(problem: Problem, settings: DTWSettings) -> Kept:
    """Keep k random trajectories of each target's largest group of similar tool paths (dynamic time warping)."""
    groups = tool_path_groups(problem, settings.groups)
    return of_largest_groups(problem, groups, random_draws(problem, "DTW"))


@selector("DTW_Hybrid", DTWHybridSettings, revision=2)
def dtw_hybrid(problem: Problem, settings: DTWHybridSettings) -> Kept:
    """Keep the k best scores of each target's largest group of similar tool paths (dynamic time warping)."""
    groups = tool_path_groups(problem, settings.groups)
    scores = composite_scores(problem, settings)
    kept = of_largest_groups(problem, groups, scores)
    return replace(kept, score=scores[kept.rows])


def tool_path_groups(problem: Problem, groups: int) -> IntArray:
    """Group of every candidate (candidates,): at most `groups` a target, no two targets share a number.

    Groups over the whole pool would be far apart in number from target to target: some targets had all of them.
    """
    with problem.stage("prepare"):
        stored = problem.waypoints(problem.pool.candidates["trajectory_id"].to_pylist())
    with problem.stage("cluster"):
        shapes = np.array([tool_shape(problem.robot, q) for q in stored])
        target = target_rows(problem)
        labels = np.empty(len(stored), dtype=np.int64)
        for number in np.unique(target):
            rows = np.flatnonzero(target == number)
            labels[rows] = number * groups + similar(shapes[rows], groups)
        return labels


def similar(shapes: Float32Array, groups: int) -> IntArray:
    """Cut `shapes` (n, POINTS, 3) into at most `groups` (n,), from 0, the largest first.

    Complete linkage, which heeds the largest distance in a group: average linkage puts nearly all in one and stray
    paths in others of their own.
    """
    if len(shapes) > _MOST_OF_A_TARGET:
        raise PlancurateError(
            f"selector DTW: {len(shapes)} tool paths to one target need too much memory "
            f"(at most {_MOST_OF_A_TARGET}): use KMeans or DBSCAN, or fewer runs"
        )
    distinct, shape_of = np.unique(shapes.reshape(len(shapes), -1), axis=0, return_inverse=True)
    if len(distinct) == 1:
        return np.zeros(len(shapes), dtype=np.int64)
    tree = linkage(pairwise_dtw(distinct.reshape(-1, POINTS, 3)), "complete")
    found = (fcluster(tree, groups, "maxclust") - 1)[shape_of]  # fcluster counts from 1
    by_size = np.argsort(-np.bincount(found), kind="stable")
    return np.asarray(np.argsort(by_size)[found], dtype=np.int64)


def of_largest_groups(problem: Problem, groups: IntArray, key: FloatArray) -> Kept:
    """Keep the k lowest keys of each target's largest group; what that lacks comes from the next largest."""
    tie = tie_draws(problem)
    with problem.stage("select"):
        order = np.empty(len(key))
        order[np.lexsort((tie, key, groups))] = np.arange(len(key))
    kept = lowest_of_scope(problem, order, "target")
    return replace(kept, cluster=groups[kept.rows])


def tool_shape(robot: Robot, q: FloatArray) -> Float32Array:
    """Points (POINTS, 3), m, evenly along the tool's path during `q` (m, n): its shape, whatever the speed."""
    tool = native.fk(robot.native, np.ascontiguousarray(q))[:, :3, 3]
    return evenly(tool, POINTS).astype(np.float32)


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
