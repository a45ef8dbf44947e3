"""What a policy sees: observation terms, each a small named function of a state.

A term is one file, here or in another package that names it as an entry point of the group
`plancurate.observations`:

    @observation_term("last_action", size=lambda robot: robot.dof)
    def last_action(state: State) -> FloatArray:
        \"\"\"Change of the joint angles in the step before, rad or m.\"\"\"
        return state.q - state.previous_q
"""

from plancurate.tasks.learning.observations.state import State, state_at
from plancurate.tasks.learning.observations.term import (
    Layout,
    ObservationTerm,
    find_term,
    goal_terms,
    layout,
    observation_term,
    observe,
    require_terms,
    term_names,
    width,
)

__all__ = [
    "Layout",
    "ObservationTerm",
    "State",
    "find_term",
    "goal_terms",
    "layout",
    "observation_term",
    "observe",
    "require_terms",
    "state_at",
    "term_names",
    "width",
]
