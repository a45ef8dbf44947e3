"""The best scores of the pool as a whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from plancurate.tasks.selectors.base import Kept, Problem, selector
from plancurate.tasks.selectors.ranking import ScoreSettings, composite_scores, lowest_of_groups, require


@selector("RuleBased_General", ScoreSettings)
def rule_based_general(problem: Problem, settings: ScoreSettings) -> Kept:
    """Keep the k x targets best scores of the whole pool, whatever their targets."""
    candidates = problem.pool.candidates.num_rows
    total = problem.budget * problem.pool.n_targets
    require(candidates, total, f"the pool (k x {problem.pool.n_targets} targets are kept)")
    scores = composite_scores(problem, settings)
    kept = lowest_of_groups(problem, np.zeros(candidates, dtype=np.int64), scores, total)
    return replace(kept, score=scores[kept.rows])
