"""Classes of paths to the same target, read part by part: those of a large pool do not fit in memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from plancurate.tasks.candidates.path_classes import POINTS
from plancurate.tasks.candidates.polylines import evenly_each
from plancurate.tasks.curation.pool import FloatArray
from plancurate.tasks.curation.selectors.agreement import NONE
from plancurate.tasks.curation.selectors.base import IntArray, Problem
from plancurate.tasks.curation.selectors.transitions import target_rows

MOST_CLASSES = 12
"""Classes of a target that are considered, those with the best scores: so the work grows with the targets alone."""
AT_ONCE = 100_000
"""Candidates, or a few more, whose paths are in memory at once: 0.5 GB."""


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
    parts = [part_classes(problem, rows, target, order, radius) for rows in whole_targets(target)]
    with problem.stage("cluster"):
        return joined(parts)


def whole_targets(target: IntArray) -> list[IntArray]:
    """Rows of candidates whose paths are read at once: those of whole targets; `target` (candidates,) ascends."""
    ends = np.append(np.flatnonzero(np.diff(target)) + 1, len(target))
    return np.split(np.arange(len(target)), ends[np.flatnonzero(np.diff(ends // AT_ONCE))])


def part_classes(
    problem: Problem, rows: IntArray, target: IntArray, order: IntArray, radius: float
) -> Classes:
    """Classes of the candidates `rows`, which follow each other, of targets (candidates,) in `order`."""
    with problem.stage("prepare"):
        ids = problem.pool.candidates["trajectory_id"].take(rows).to_pylist()
        points = evenly_each(problem.waypoints(ids), POINTS)
    with problem.stage("cluster"):
        own = order[(order >= rows[0]) & (order <= rows[-1])] - rows[0]
        found = path_classes(points, target[rows], own, radius)
        return replace(found, first=found.first + rows[0])


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
    grouped = order[np.argsort(target[order], kind="stable")]
    for rows in np.split(grouped, np.flatnonzero(np.diff(target[grouped])) + 1):
        left = rows
        for _ in range(MOST_CLASSES):
            if not len(left):
                break
            founder = left[0]
            near = np.abs(points[left] - points[founder]).max(axis=(1, 2)) <= radius
            label[left[near]] = len(first)
            first.append(int(founder))
            left = left[~near]
    representative = np.array(first)
    return Classes(label, representative, target[representative], points[representative])
