"""The control that tells less data from better data."""

from __future__ import annotations

from plancurate.tasks.curation.selectors.base import Kept, Problem, Settings, selector
from plancurate.tasks.curation.selectors.ranking import lowest_of_scope, random_draws


@selector("Random")
def random(problem: Problem, settings: Settings) -> Kept:
    """Keep k random trajectories of each target."""
    return lowest_of_scope(problem, random_draws(problem, "Random"), "target")
