"""The best scores of the pool as a whole."""

from __future__ import annotations

from dataclasses import replace

from plancurate.tasks.curation.selectors.base import Kept, Problem, selector
from plancurate.tasks.curation.selectors.ranking import ScoreSettings, composite_scores, lowest_of_scope


@selector("RuleBased_General", ScoreSettings, revision=2)
def rule_based_general(problem: Problem, settings: ScoreSettings) -> Kept:
    """Keep the k x targets best scores of the whole pool, whatever their targets."""
    scores = composite_scores(problem, settings)
    kept = lowest_of_scope(problem, scores, "pool")
    return replace(kept, score=scores[kept.rows])
