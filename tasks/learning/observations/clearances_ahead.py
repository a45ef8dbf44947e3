"""The term that feels along the rest of the straight way to the goal, and to either side of it.

It tells where that way is blocked, and which joint's turn would free it: what lies ahead, before the arm is there.
"""

from __future__ import annotations

import numpy as np

from plancurate.tasks.learning.observations.clearances import clearances
from plancurate.tasks.learning.observations.state import FloatArray, State
from plancurate.tasks.learning.observations.term import observation_term

POINTS = 4  # equally spaced, the last of them the goal
SIDE_RAD = 0.4  # how far to either side of a joint is felt


@observation_term("clearances_ahead", size=lambda robot: POINTS * (1 + 2 * robot.dof), needs_goal=True)
def clearances_ahead(state: State) -> FloatArray:
    """Clearance at each quarter of the straight joint line to the goal, there also with each joint 0.4 rad aside, m."""
    assert state.goal is not None  # observe sees to that
    b, n = state.q.shape
    share = (np.arange(1, POINTS + 1) / POINTS)[:, None]
    along = state.q[:, None] + share * (state.goal - state.q)[:, None]
    sides = SIDE_RAD * np.concatenate([np.zeros((1, n)), -np.eye(n), np.eye(n)])
    return clearances(state, (along[:, :, None] + sides).reshape(b, -1, n))
