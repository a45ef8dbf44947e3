"""Goal configurations: where demonstrations end, and which one a tested position takes from those around it.

A policy that observes a goal configuration is shown, in training, the end of each demonstration. At a tested position
nobody has planned, so the goal there is an inverse-kinematics solution: the one that agrees best with the ends of
the demonstrations to the training targets around it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from plancurate.tasks.candidates.path_classes import GOAL_RADIUS

FloatArray = npt.NDArray[np.float64]
NEIGHBOURS = 3
"""Training targets around a position that have a say in its goal."""
NEAR_M = 1e-3
"""Distance within which a training target counts as the position itself, m."""


@dataclass(frozen=True, eq=False)
class TrainingGoals:
    """g training targets and the goal configuration that the demonstrations to each stand for."""

    positions: FloatArray
    """(g, 3), m."""
    configurations: FloatArray
    """(g, n), rad or m."""


def training_goals(positions: FloatArray, ends: FloatArray) -> TrainingGoals:
    """The goals of demonstrations that lead to positions (d, 3) and end at configurations (d, n).

    Of several ends at one target it is the medoid, the one nearest to all the others: a mean could lie between two
    ways of reaching the target.
    """
    targets, number = np.unique(positions, axis=0, return_inverse=True)
    number = number.reshape(-1)
    return TrainingGoals(targets, np.stack([medoid(ends[number == k]) for k in range(len(targets))]))


def medoid(q: FloatArray) -> FloatArray:
    """The configuration of q (k, n) with the least mean distance to the others."""
    return np.asarray(q[np.linalg.norm(q[:, None] - q, axis=2).sum(axis=1).argmin()])


def expected_goals(training: TrainingGoals, positions: FloatArray) -> FloatArray:
    """Goal configurations (t, n) that the training targets around positions (t, 3) suggest.

    A mean by inverse distance over those of the nearest training targets whose goals are of one class: of the class
    that weighs most. So where all differ it is the nearest target's, and never a mean of two classes.
    """
    count = min(NEIGHBOURS, len(training.positions))
    distances, nearest = KDTree(training.positions).query(positions, k=range(1, count + 1))
    goals = training.configurations[nearest]
    weights = 1 / np.maximum(distances, NEAR_M)
    agree = np.abs(goals[:, :, None] - goals[:, None]).max(axis=3) <= GOAL_RADIUS
    lead = (agree @ weights[:, :, None])[:, :, 0].argmax(axis=1)
    weights = weights * agree[np.arange(len(positions)), lead]
    return np.asarray(np.einsum("tk,tkn->tn", weights, goals) / weights.sum(axis=1, keepdims=True))


def chosen_goals(
    training: TrainingGoals, positions: FloatArray, solutions: Sequence[FloatArray]
) -> FloatArray:
    """Goal configurations (t, n) of positions (t, 3): of the solutions of each, (k, n), the nearest to the expected.

    The expected one itself where there is no solution.
    """
    expected = expected_goals(training, positions)
    return np.stack([nearest_to(goal, known) for goal, known in zip(expected, solutions, strict=True)])


def nearest_to(goal: FloatArray, solutions: FloatArray) -> FloatArray:
    """The solution (k, n) nearest to a goal (n,); the goal itself without any."""
    if not len(solutions):
        return goal
    return np.asarray(solutions[np.linalg.norm(solutions - goal, axis=1).argmin()])
