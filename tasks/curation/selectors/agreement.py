"""One class for each target such that neighbouring targets agree: a labelling of the graph of targets.

Energy: the cost of every target's class plus, for every pair of neighbours, the cost of their two classes together.
Iterated conditional modes (Besag 1986) lowers it target by target. That stops at the nearest minimum, so it starts
several times: from every target's own best class, and from labellings grown from one target outwards, which agree.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from plancurate.tasks.curation.pool import FloatArray
from plancurate.tasks.curation.selectors.base import IntArray

NONE = -1  # of a target that is left out, or not labelled yet
_SWEEPS = 100


@dataclass(frozen=True, eq=False)
class Graph:
    """Targets, costs of their classes, and neighbours; c is the largest number of classes of a target."""

    cost: FloatArray
    """(targets, c): infinite beyond a target's classes."""
    neighbours: list[IntArray]
    """(d,) of each target; who is a neighbour has it as a neighbour."""
    pairs: list[FloatArray]
    """(d, c, c) of each target: cost of its class (first) with a neighbour's (second), as counted in the energy."""

    def costs(self, target: int, labels: IntArray) -> FloatArray:
        """Cost (c,) of each class of a target, given the classes (targets,) of its neighbours."""
        return np.asarray(self.cost[target] + self.with_neighbours(target, labels).sum(axis=0))

    def with_neighbours(self, target: int, labels: IntArray) -> FloatArray:
        """Cost (d', c) of each class of a target with each neighbour that has a class."""
        theirs = labels[self.neighbours[target]]
        known = np.flatnonzero(theirs != NONE)
        return self.pairs[target][known, :, theirs[known]]


def energy(graph: Graph, labels: IntArray) -> float:
    """Energy of classes (targets,)."""
    total = 0.0
    for target in np.flatnonzero(labels != NONE).tolist():
        label = labels[target]
        together = graph.with_neighbours(target, labels)[:, label].sum()
        total += graph.cost[target, label] + together / 2  # every pair is met twice
    return total


def settled(graph: Graph, labels: IntArray) -> IntArray:
    """Change classes (targets,) one target after another until none can be bettered."""
    labels = labels.copy()
    pending = labels != NONE  # a target is looked at again once a neighbour has changed
    for _ in range(_SWEEPS):
        if not pending.any():
            break
        for target in range(len(labels)):
            if not pending[target]:
                continue
            pending[target] = False
            costs = graph.costs(target, labels)
            best = int(costs.argmin())
            if costs[best] < costs[labels[target]] - 1e-12:
                labels[target] = best
                near = graph.neighbours[target]
                pending[near] = labels[near] != NONE
    return labels


def grown(graph: Graph, order: IntArray) -> IntArray:
    """Give each target, in `order`, the class that suits those labelled before it best."""
    labels = np.full(len(graph.cost), NONE)
    for target in order:
        labels[target] = graph.costs(target, labels).argmin()
    return labels


def labelling(graph: Graph, orders: Iterable[IntArray]) -> IntArray:
    """Classes (targets,) of the lowest energy found; `orders` are those of all targets in which a start is grown."""
    starts = [graph.cost.argmin(axis=1), *(grown(graph, order) for order in orders)]
    found = [settled(graph, start) for start in starts]
    return min(found, key=lambda labels: energy(graph, labels))


def without_strangers(distance: Graph, labels: IntArray, most: int) -> IntArray:
    """Leave out at most `most` targets whose class does not agree with their neighbours', the worst first.

    The pair costs of `distance` are distances of classes, in units of that at which two are different ways. A target
    is left out when its mean distance is above 1 and above twice the usual one: where targets are few and far from
    each other, so are their paths.
    """
    labels = labels.copy()
    mean = np.array([_mean(distance, target, labels) for target in range(len(labels))])
    for _ in range(most):
        kept = labels != NONE
        limit = max(1.0, 2 * float(np.median(mean[kept]))) if kept.any() else np.inf
        worst = int(np.where(kept, mean, -np.inf).argmax())
        if mean[worst] <= limit:
            break
        labels[worst] = NONE
        for near in distance.neighbours[worst]:
            mean[near] = _mean(distance, near, labels)
    return labels


def _mean(distance: Graph, target: int, labels: IntArray) -> float:
    if labels[target] == NONE:
        return -np.inf
    costs = distance.with_neighbours(target, labels)[:, labels[target]]
    return float(costs.mean()) if len(costs) else 0.0
