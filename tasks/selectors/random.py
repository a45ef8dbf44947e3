"""The control that tells less data from better data."""

from __future__ import annotations

import numpy as np

from plancurate.tasks.selectors.base import IntArray, Kept, Problem, Settings, selector
from plancurate.tasks.selectors.ranking import lowest_of_groups, random_draws, require


@selector("Random")
def random(problem: Problem, settings: Settings) -> Kept:
    """Keep k random trajectories of each target."""
    with problem.stage("prepare"):
        targets: IntArray = problem.pool.candidates["target_id"].to_numpy().astype(np.int64)
        for target in problem.pool.targets["target_id"].to_pylist():
            require(int(np.sum(targets == target)), problem.budget, f"target {target}")
    return lowest_of_groups(problem, targets, random_draws(problem, "Random"), problem.budget)
