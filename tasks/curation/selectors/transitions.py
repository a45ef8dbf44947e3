"""The pool step by step, for selectors that look inside trajectories."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from plancurate.tasks.curation.pool import FloatArray
from plancurate.tasks.curation.selectors.base import IntArray, Problem
from plancurate.tasks.learning.demonstrations import Float32Array, demonstrations


@dataclass(frozen=True, eq=False)
class Transitions:
    """Steps of all candidates one after another, in the order of the candidates, without held ones."""

    observations: Float32Array
    """(steps, o): target minus tool position (m), then joint angles, whatever a study's policies see."""
    actions: Float32Array
    """(steps, n): next joint angles minus the present ones; zero at a trajectory's last waypoint."""
    starts: IntArray
    """(candidates,): first step of each candidate."""
    lengths: IntArray
    """(candidates,): waypoints of each candidate."""

    @property
    def candidate(self) -> IntArray:
        """Row of the candidate that each step (steps,) belongs to."""
        return np.repeat(np.arange(len(self.lengths)), self.lengths)

    def mean(self, values: FloatArray) -> FloatArray:
        """Mean (candidates,) of values (steps,) over each candidate's steps."""
        return np.asarray(np.add.reduceat(values, self.starts) / self.lengths)


def load_transitions(problem: Problem) -> Transitions:
    """Read the waypoints of all candidates of the pool."""
    pool = problem.pool
    paths = problem.waypoints(pool.candidates["trajectory_id"].to_pylist())
    targets = pool.target_positions()[target_rows(problem)]
    steps = demonstrations(problem.robot, problem.scene, paths, targets, hold_steps=0)
    return Transitions(steps.observations, steps.actions, steps.starts, steps.lengths)


def target_rows(problem: Problem) -> IntArray:
    """Row (candidates,) of each candidate's target among the pool's targets."""
    targets = problem.pool.targets["target_id"].to_numpy()  # in order of id
    return np.asarray(np.searchsorted(targets, problem.pool.candidates["target_id"].to_numpy()))


def standardised(values: FloatArray | Float32Array) -> Float32Array:
    """Columns (rows, n) less their mean, in units of their standard deviation; constant ones become zero."""
    spread = values.std(axis=0)
    centred = values - values.mean(axis=0)
    return np.asarray(centred / np.where(spread > 1e-6, spread, np.inf), dtype=np.float32)
