"""The term that needs a goal: where the joints are to end."""

from __future__ import annotations

from plancurate.tasks.learning.observations.state import FloatArray, State
from plancurate.tasks.learning.observations.term import observation_term


@observation_term("goal_offset", size=lambda robot: robot.dof, needs_goal=True)
def goal_offset(state: State) -> FloatArray:
    """Goal configuration minus joint angles, rad (m for a sliding joint)."""
    assert state.goal is not None  # observe sees to that
    return state.goal - state.q
