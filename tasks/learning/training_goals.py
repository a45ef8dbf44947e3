"""Goal configurations: where demonstrations end, and which one a tested position takes from those around it.

A policy that observes a goal configuration is shown, in training, the end of each demonstration. At a tested position
nobody has planned, so the goal there is an inverse-kinematics solution: the one that continues the ends of the
demonstrations to the training targets around it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.tasks.candidates.continued_goals import continued_goals, suggested_goals
from plancurate.tasks.candidates.settings import TargetSettings

FloatArray = npt.NDArray[np.float64]
REVISION = 1
"""Raise it when tests are shown other goals than before: the ids of evaluations that have any hold it."""


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
    """Goal configurations (t, n) that the training targets around positions (t, 3) suggest (`suggested_goals`)."""
    return suggested_goals(training.positions, training.configurations, positions)


def chosen_goals(
    training: TrainingGoals,
    robot: Robot,
    scene: Scene,
    positions: FloatArray,
    settings: TargetSettings,
    solutions: Callable[[int], FloatArray],
) -> FloatArray:
    """Goal configurations (t, n) of positions (t, 3), m: inverse kinematics continued from what is expected there.

    Where that ends nowhere or in a collision, it is the one of `solutions(i)` (k, n), free goals of position i, that
    is nearest to the expected goal; the expected one itself where there is no solution.
    """
    expected = expected_goals(training, positions)
    goals, found = continued_goals(robot, scene, positions, expected, settings)
    for number in np.flatnonzero(~found):
        goals[number] = nearest_to(expected[number], solutions(int(number)))
    return goals


def nearest_to(goal: FloatArray, solutions: FloatArray) -> FloatArray:
    """The solution (k, n) nearest to a goal (n,); the goal itself without any."""
    if not len(solutions):
        return goal
    return np.asarray(solutions[np.linalg.norm(solutions - goal, axis=1).argmin()])
