"""Goal configurations: where demonstrations end, and which one a tested position takes from those around it.

A policy that observes a goal configuration is shown, in training, the end of each demonstration. At a tested position
nobody has planned, so the goal there is an inverse-kinematics solution: the one that continues the ends of the
demonstrations to the training targets around it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.tasks.candidates.continued_goals import agreeing_goals, suggested_goals
from plancurate.tasks.candidates.settings import TargetSettings
from plancurate.tasks.learning.reach import goal_solutions

FloatArray = npt.NDArray[np.float64]
REVISION = 1
"""Raise it when tests are shown other goals than before: the ids of evaluations that have any hold it."""
NEAR_STREAM = 2
"""The position's generator that searches around an expected goal; `goal_solutions` draws from another."""


@dataclass(frozen=True, eq=False)
class TrainingGoals:
    """g training targets and the goal configuration that the demonstrations to each stand for; equal if these are."""

    positions: FloatArray
    """(g, 3), m."""
    configurations: FloatArray
    """(g, n), rad or m."""

    def __eq__(self, other: object) -> bool:
        return isinstance(other, TrainingGoals) and self._content == other._content

    def __hash__(self) -> int:
        return hash(self._content)

    @property
    def _content(self) -> tuple[bytes, bytes]:
        return self.positions.tobytes(), self.configurations.tobytes()

    def at(self, positions: FloatArray) -> FloatArray:
        """Goal configurations (t, n) that they suggest at positions (t, 3), m: see `suggested_goals`."""
        return suggested_goals(self.positions, self.configurations, positions)


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


def chosen_goals(
    training: TrainingGoals,
    robot: Robot,
    scene: Scene,
    positions: FloatArray,
    settings: TargetSettings,
    seeds: Sequence[tuple[int, ...]],
) -> FloatArray:
    """Goal configurations (t, n) of positions (t, 3), m: those that agree best with what is expected there.

    Inverse kinematics continues from the expected goal; where that ends nowhere or in a collision, it searches around
    it and everywhere, by the seed of the position; the expected goal itself stands where there is no free one.
    """
    expected = training.at(positions)
    return agreeing_goals(
        robot,
        scene,
        positions,
        expected,
        settings,
        [(*seed, NEAR_STREAM) for seed in seeds],
        lambda i: goal_solutions(robot, scene, positions[i], settings, seeds[i]),
    )
