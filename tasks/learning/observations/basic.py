"""Terms that need nothing but the robot and its target."""

from __future__ import annotations

from plancurate.tasks.learning.observations.state import FloatArray, State
from plancurate.tasks.learning.observations.term import observation_term


@observation_term("target_offset", size=lambda robot: 3)
def target_offset(state: State) -> FloatArray:
    """Target minus tool position, m."""
    return state.target_offset


@observation_term("joint_positions", size=lambda robot: robot.dof)
def joint_positions(state: State) -> FloatArray:
    """Joint angles, rad (m for a sliding joint)."""
    return state.q


@observation_term("last_action", size=lambda robot: robot.dof)
def last_action(state: State) -> FloatArray:
    """Change of the joint angles in the step before, rad; zero where the motion begins."""
    return state.q - state.previous_q
