"""Ours: what a policy can learn is which way to go, so neighbouring targets should be shown the same one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pydantic import Field
from scipy.spatial import KDTree
from scipy.spatial.distance import cdist

from plancurate.tasks.curation.pool import FloatArray
from plancurate.tasks.curation.selectors.agreement import NONE, Graph, labelling, settled, without_strangers
from plancurate.tasks.curation.selectors.base import IntArray, Kept, Problem, selector
from plancurate.tasks.curation.selectors.path_groups import Classes, pool_classes
from plancurate.tasks.curation.selectors.ranking import (
    ScoreSettings,
    composite_scores,
    lowest_of_groups,
    tie_draws,
)

STARTS = 8
"""Targets from which a consistent start is grown."""


class ModeConsistentSettings(ScoreSettings):
    """Classes, their agreement, and the score."""

    radius: float = Field(
        1.0, gt=0, description="rad (m) that a joint may differ by, anywhere on two paths of one class"
    )
    neighbours: int = Field(8, ge=1, description="nearest targets that a target is to agree with")
    agreement: float = Field(
        5.0, ge=0, description="cost of neighbours' paths a radius apart, in standard deviations of the score"
    )
    leave_out: float = Field(0.2, ge=0, lt=1, description="share of the targets that may be left out")


@selector("ModeConsistent", ModeConsistentSettings)
def mode_consistent(problem: Problem, settings: ModeConsistentSettings) -> Kept:
    """Keep the k best scores of one way to each target, chosen such that neighbouring targets go the same way."""
    scores = composite_scores(problem, settings)
    tie = tie_draws(problem)
    classes = pool_classes(problem, np.lexsort((tie, scores)), settings.radius)
    with problem.stage("cluster"):
        standard = scores / (scores.std() or 1.0)
        chosen = consistent(classes, standard, problem.pool.target_positions(), settings, problem.seed)
        groups = np.where(np.isin(classes.of_candidate, chosen), classes.of_candidate, NONE)
    kept = lowest_of_groups(problem, groups, scores, problem.budget)
    return replace(kept, cluster=groups[kept.rows], score=scores[kept.rows])


def consistent(
    classes: Classes, score: FloatArray, position: FloatArray, settings: ModeConsistentSettings, seed: int
) -> IntArray:
    """The chosen classes, at most one a target, given scores (candidates,) and targets' positions (targets, 3)."""
    present, begin = np.unique(classes.target, return_index=True)
    where = position[present]
    own = np.split(np.arange(len(classes.first)), begin[1:])
    near = neighbours(where, settings.neighbours)
    distance = distances(own, classes.points, near, settings.radius)
    graph = weighted([score[classes.first[some]] for some in own], where, distance, settings)
    rng = np.random.default_rng(seed)
    roots = rng.permutation(len(present))[:STARTS]
    orders = (np.linalg.norm(where - where[root], axis=1).argsort(kind="stable") for root in roots)
    labels = labelling(graph, orders)
    labels = without_strangers(distance, labels, int(settings.leave_out * len(present)))
    labels = settled(graph, labels)
    kept = np.flatnonzero(labels != NONE)
    return np.asarray(begin[kept] + labels[kept])


def neighbours(position: FloatArray, number: int) -> list[IntArray]:
    """Neighbours of each position (targets, 3): its `number` nearest, and those whose nearest it is."""
    count = len(position)
    _, nearest = KDTree(position).query(position, k=min(number + 1, count))
    near: list[set[int]] = [set() for _ in range(count)]
    for target, others in enumerate(np.reshape(nearest, (count, -1)).tolist()):
        for other in others:
            if other != target:
                near[target].add(other)
                near[other].add(target)
    return [np.array(sorted(others), dtype=np.int64) for others in near]


def distances(rows: Sequence[IntArray], points: FloatArray, near: list[IntArray], radius: float) -> Graph:
    """Largest joint differences along the paths of neighbours' classes, in radii; `rows` are each target's classes."""
    most = max(len(own) for own in rows)
    flat = points.reshape(len(points), -1)
    pairs = [np.zeros((len(others), most, most)) for others in near]
    for target, others in enumerate(near):
        own = rows[target]
        for place, other in enumerate(others.tolist()):
            if other < target:  # the pair is there already
                pairs[target][place] = pairs[other][np.searchsorted(near[other], target)].T
            else:
                apart = cdist(flat[own], flat[rows[other]], "chebyshev") / radius
                pairs[target][place, : len(own), : len(rows[other])] = apart
    return Graph(np.zeros((len(rows), most)), near, pairs)


def weighted(
    scores: Sequence[FloatArray], position: FloatArray, distance: Graph, settings: ModeConsistentSettings
) -> Graph:
    """The graph whose energy is lowest where scores are low and neighbours agree, near ones above all."""
    cost = np.full(distance.cost.shape, np.inf)
    for target, own in enumerate(scores):
        cost[target, : len(own)] = own
    away = [
        np.linalg.norm(position[near] - here, axis=1)
        for near, here in zip(distance.neighbours, position, strict=True)
    ]
    usual = float(np.median(np.concatenate(away))) or 1.0 if len(position) > 1 else 1.0
    share = settings.agreement / settings.neighbours
    pairs = [
        apart * (share * usual / (usual + d))[:, None, None]
        for apart, d in zip(distance.pairs, away, strict=True)
    ]
    return Graph(cost, distance.neighbours, pairs)
