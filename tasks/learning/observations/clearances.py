"""Terms that feel for obstacles: how near they are here, a little to each side, and on the way to the goal.

Obstacles and the floor count, the robot itself does not: its neighbouring links are near each other everywhere.
"""

from __future__ import annotations

import numpy as np

from plancurate import native
from plancurate.tasks.learning.observations.state import FloatArray, State
from plancurate.tasks.learning.observations.term import observation_term

RANGE_M = 0.3  # obstacles farther away are all alike
SIDE_RAD = 0.15  # how far to either side of a joint is felt
AHEAD_RAD = 0.06  # length of a step toward the goal, the default of an arc step
AHEAD = 3  # steps felt


@observation_term("clearances_around", size=lambda robot: 1 + 2 * robot.dof)
def clearances_around(state: State) -> FloatArray:
    """Clearance here and with each joint 0.15 rad (m) lower, then higher, m, at most 0.3."""
    n = state.q.shape[1]
    sides = SIDE_RAD * np.concatenate([np.zeros((1, n)), -np.eye(n), np.eye(n)])
    return clearances(state, state.q[:, None] + sides)


@observation_term("clearances_toward_goal", size=lambda robot: AHEAD, needs_goal=True)
def clearances_toward_goal(state: State) -> FloatArray:
    """Clearance 0.06, 0.12 and 0.18 rad along the straight joint line to the goal, which ends there, m, at most 0.3."""
    assert state.goal is not None  # observe sees to that
    way = state.goal - state.q
    length = np.linalg.norm(way, axis=1)[:, None]
    gone = np.minimum(AHEAD_RAD * np.arange(1, AHEAD + 1), length)
    share = np.divide(gone, length, out=np.zeros_like(gone), where=length > 0)
    return clearances(state, state.q[:, None] + share[:, :, None] * way[:, None])


def clearances(state: State, q: FloatArray) -> FloatArray:
    """Distances (b, k) of the arm from obstacles and floor at joint angles q (b, k, n), m, from 0 to 0.3."""
    flat = np.ascontiguousarray(q.reshape(-1, q.shape[-1]))
    found = native.clearance(state.robot.native_without_pairs, state.scene.native, flat)
    return np.clip(found, 0.0, RANGE_M).reshape(q.shape[:2])
