"""Classes of paths to the same target, read part by part: those of a large pool do not fit in memory."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.distance import cdist

from plancurate.tasks.candidates.path_classes import POINTS
from plancurate.tasks.candidates.polylines import evenly_each
from plancurate.tasks.curation.pool import FloatArray
from plancurate.tasks.curation.selectors.agreement import NONE
from plancurate.tasks.curation.selectors.base import IntArray, Problem
from plancurate.tasks.curation.selectors.transitions import target_rows

MOST_CLASSES = 12
"""Classes of a target that are considered, those with the best scores: so the work grows with the targets alone."""
READ_AT_ONCE = 100_000
"""Candidates, or a few more, whose paths are in memory at once: 0.5 GB."""
COMPARED_AT_ONCE = 1000
"""Candidates, or a few more, whose resampled paths are compared while they are in the processor's cache."""

SOME = 8
"""Every so many points of two paths are compared first: most paths of another way are told by them already."""


@dataclass(frozen=True, eq=False)
class Classes:
    """Candidates of the same way to the same target."""

    of_candidate: IntArray
    """(candidates,): class, NONE where it is none of those considered."""
    first: IntArray
    """(classes,): candidate with the best score, which stands for its class."""
    target: IntArray
    """(classes,): row of the target, ascending."""
    points: FloatArray
    """(classes, m, n): path of the first, resampled."""


def pool_classes(problem: Problem, order: IntArray, radius: float) -> Classes:
    """Classes of all candidates of the pool in `order` (candidates,), best first; see `path_classes`."""
    target = target_rows(problem)
    rank = np.argsort(order)
    parts = [
        found
        for rows in whole_targets(target, READ_AT_ONCE)
        for found in part_classes(problem, rows, target[rows], rank[rows], radius)
    ]
    with problem.stage("cluster"):
        return joined(parts)


def whole_targets(target: IntArray, at_once: int) -> list[IntArray]:
    """Rows of candidates that are worked on at once: those of whole targets; `target` (candidates,) ascends."""
    ends = np.append(np.flatnonzero(np.diff(target)) + 1, len(target))
    return np.split(np.arange(len(target)), ends[np.flatnonzero(np.diff(ends // at_once))])


def part_classes(
    problem: Problem, rows: IntArray, target: IntArray, rank: IntArray, radius: float
) -> Iterator[Classes]:
    """Classes of the candidates `rows` (c,), which follow each other, of targets (c,) and with ranks (c,)."""
    with problem.stage("prepare"):
        ids = problem.pool.candidates["trajectory_id"].take(rows).to_pylist()
        paths = problem.waypoints(ids)
    for some in whole_targets(target, COMPARED_AT_ONCE):
        with problem.stage("prepare"):
            points = evenly_each(paths[some[0] : some[-1] + 1], POINTS)
        with problem.stage("cluster"):
            found = path_classes(points, target[some], np.argsort(rank[some]), radius)
        yield replace(found, first=found.first + rows[some[0]])


def joined(parts: Sequence[Classes]) -> Classes:
    """Classes of parts of the candidates, one after another."""
    begin = np.cumsum([0, *(len(part.first) for part in parts[:-1])])
    labels = [
        np.where(part.of_candidate == NONE, NONE, part.of_candidate + number)
        for part, number in zip(parts, begin, strict=True)
    ]
    first, target, points = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("first", "target", "points")
    )
    return Classes(np.concatenate(labels), first, target, points)


def path_classes(points: FloatArray, target: IntArray, order: IntArray, radius: float) -> Classes:
    """Group paths, resampled to `points` (candidates, m, n), to each target (candidates,).

    In `order`, best first: a path joins the first class whose representative it follows within `radius` all along, or
    founds one, up to MOST_CLASSES.
    """
    label = np.full(len(points), NONE)
    first: list[int] = []
    whole, few = points.reshape(len(points), -1), points[:, ::SOME].reshape(len(points), -1)
    grouped = order[np.argsort(target[order], kind="stable")]
    for rows in np.split(grouped, np.flatnonzero(np.diff(target[grouped])) + 1):
        left = rows
        for _ in range(MOST_CLASSES):
            if not len(left):
                break
            founder = left[0]
            near = cdist(few[left], few[[founder]], "chebyshev")[:, 0] <= radius
            near[near] = cdist(whole[left[near]], whole[[founder]], "chebyshev")[:, 0] <= radius
            label[left[near]] = len(first)
            first.append(int(founder))
            left = left[~near]
    representative = np.array(first)
    return Classes(label, representative, target[representative], points[representative])
