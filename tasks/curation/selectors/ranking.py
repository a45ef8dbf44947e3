"""Scores, draws and the best of each group, computed by SQL."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import pyarrow as pa
from pydantic import Field

from plancurate.tasks.curation.pool import METRICS, FloatArray
from plancurate.tasks.curation.selectors.base import IntArray, Kept, Problem, Settings


class ScoreSettings(Settings):
    """How the composite score adds up; weights apply to the scaled metrics."""

    scaling: Literal["zscore", "raw"] = "zscore"
    joint_movement: float = Field(1.0, allow_inf_nan=False)
    smoothness: float = Field(1.0, allow_inf_nan=False)
    path_length: float = Field(1.0, allow_inf_nan=False)


def composite_scores(problem: Problem, settings: ScoreSettings) -> FloatArray:
    """Score of every candidate (candidates,), lower is better."""
    weights = {name: getattr(settings, name) for name in METRICS}
    with problem.stage("score"):
        rows = problem.sql("pool/score", scaling=settings.scaling, **weights)
        return np.asarray(rows["score"].to_numpy(), dtype=np.float64)


def random_draws(problem: Problem, salt: str) -> FloatArray:
    """A number in [0, 1) for every candidate (candidates,), by seed and salt."""
    with problem.stage("score"):
        rows = problem.sql("pool/draw", salt=f"{salt}/{problem.seed}")
        return np.asarray(rows["draw"].to_numpy(), dtype=np.float64)


def tie_draws(problem: Problem) -> FloatArray:
    """The order (candidates,) in which equal keys are taken, drawn by the seed."""
    return random_draws(problem, "tie")


def lowest_of_groups(problem: Problem, groups: IntArray, key: FloatArray, budget: int) -> Kept:
    """Keep the `budget` lowest keys of each group, all where it holds fewer; ties are drawn.

    Groups (candidates,) hold -1 for no group at all.
    """
    tie = tie_draws(problem)
    with problem.stage("select"):
        member = np.flatnonzero(groups >= 0)
        keyed = {"row": member, "group_id": groups[member], "key": key[member], "tie": tie[member]}
        problem.connection.register("keyed", pa.table(keyed))
        rows = problem.sql("pool/rank", budget=budget)
        problem.connection.unregister("keyed")
        return Kept(rows=rows["row"].to_numpy(), rank=rows["rank"].to_numpy())


def split_half(halves: tuple[FloatArray, FloatArray], groups: IntArray) -> float:
    """Spearman's correlation of two estimates (candidates,) of a score, the mean over groups (candidates,).

    Each comes from one half of the evidence, so that scores from all of it rank more stably than this says: by the
    formula of Spearman and Brown their own correlation is 2 r / (1 + r). 0 where no group has candidates that both
    estimates tell apart.
    """
    found = []
    for group in np.unique(groups):
        here = [half[groups == group] for half in halves]
        if all(np.ptp(scores) > 0 for scores in here):
            ranks = [scores.argsort(kind="stable").argsort() for scores in here]
            found.append(np.corrcoef(*ranks)[0, 1])
    return float(np.mean(found)) if found else 0.0


Scope = Literal["target", "pool"]


def highest_of_scope(problem: Problem, score: FloatArray, scope: Scope) -> Kept:
    """Keep as `lowest_of_scope` does, with the score (candidates,), the highest first."""
    kept = lowest_of_scope(problem, -score, scope)
    return replace(kept, score=score[kept.rows])


def highest_of_all(problem: Problem, score: FloatArray, count: int) -> Kept:
    """Keep so many candidates of the whole pool, those of the highest score (candidates,); ties are drawn."""
    tie = tie_draws(problem)
    with problem.stage("select"):
        rows = np.lexsort((tie, -score))[:count]
        return Kept(rows=rows, rank=np.arange(1, len(rows) + 1), score=score[rows])


def lowest_of_scope(problem: Problem, key: FloatArray, scope: Scope) -> Kept:
    """Keep the `budget` lowest keys of each target, or as many of the pool as a whole wherever they lead.

    All candidates of a target, or of the pool, that holds fewer.
    """
    targets: IntArray = problem.pool.candidates["target_id"].to_numpy().astype(np.int64)
    if scope == "pool":
        return lowest_of_groups(problem, np.zeros_like(targets), key, problem.budget * problem.pool.n_targets)
    return lowest_of_groups(problem, targets, key, problem.budget)
