"""SCIZOR: leave out steps that make little progress and motions that are shown already.

Zhang et al.: SCIZOR: A Self-Supervised Approach to Data Curation for Large-Scale Imitation Learning, 2025.
It is made to leave out the few bad steps of mostly good data, as SCIZOR_Native does; the other two rank
trajectories by the same scores. The state holds the way to the target, as the images of the method's own data
show the goal: without it a motion away from the target is progress.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from pydantic import Field

from plancurate.tasks.curation.pool import FloatArray
from plancurate.tasks.curation.selectors.base import IntArray, Kept, Problem, Settings, selector
from plancurate.tasks.curation.selectors.duplicates import Chunks, cut, duplicated, whole_duplicates
from plancurate.tasks.curation.selectors.progress import (
    Clocked,
    lacks,
    suboptimality,
    train_classifier,
    units,
)
from plancurate.tasks.curation.selectors.ranking import Scope, lowest_of_scope
from plancurate.tasks.curation.selectors.transitions import (
    Transitions,
    load_transitions,
    standardised,
    target_rows,
)
from plancurate.tasks.curation.selectors.windows import Mask, kept_waypoints


class SCIZORSettings(Settings):
    """Classifier and duplicates."""

    classifier_steps: int = Field(
        300,
        ge=1,
        description="gradient steps of the progress classifier; with many it learns detours by heart",
    )
    duplicate_similarity: float = Field(
        0.99, ge=-1, le=1, description="chunks of a higher cosine are duplicates"
    )


class SCIZORNativeSettings(SCIZORSettings):
    """How many steps are kept."""

    kept_share: float = Field(0.707, gt=0, le=1, description="share of the steps with the best progress")


@dataclass(frozen=True, eq=False)
class Scored:
    """A scored pool."""

    transitions: Transitions
    suboptimality: FloatArray
    """(steps,): higher is worse."""
    chunks: Chunks
    duplicate: Mask
    """(chunks,): shown already by an earlier candidate to the same target."""


@selector("SCIZOR", SCIZORSettings, revision=2)
def scizor(problem: Problem, settings: SCIZORSettings) -> Kept:
    """Keep the k trajectories of each target that lack least progress, copies of others last."""
    return _best_trajectories(problem, settings, "target")


@selector("SCIZOR_Global", SCIZORSettings, revision=2)
def scizor_global(problem: Problem, settings: SCIZORSettings) -> Kept:
    """Keep the k x targets trajectories of the pool that lack least progress, copies of others last."""
    return _best_trajectories(problem, settings, "pool")


@selector("SCIZOR_Native", SCIZORNativeSettings, budgeted=False)
def scizor_native(problem: Problem, settings: SCIZORNativeSettings) -> Kept:
    """Keep the steps that lack least progress and are not shown already, whatever the budget."""
    found = score(problem, settings)
    with problem.stage("select"):
        kept = kept_steps(found, settings.kept_share)
        steps = kept_waypoints(found.transitions, kept)
        rows = np.flatnonzero([len(waypoints) for waypoints in steps])
        return Kept(rows, steps=[steps[row] for row in rows])


def _best_trajectories(problem: Problem, settings: SCIZORSettings, scope: Scope) -> Kept:
    found = score(problem, settings)
    with problem.stage("score"):
        lack = found.transitions.mean(found.suboptimality)
        copies = whole_duplicates(found.chunks, found.duplicate, len(lack))
        penalised = lack + copies * (1 + np.ptp(lack))
    kept = lowest_of_scope(problem, penalised, scope)
    return replace(kept, score=penalised[kept.rows])


def score(problem: Problem, settings: SCIZORSettings) -> Scored:
    """Train the classifier on the pool, score its steps and look for duplicates."""
    with problem.stage("prepare"):
        transitions = load_transitions(problem)
        clocked = clocked_steps(transitions, problem.pool.candidates["dt"].to_numpy())
    with problem.stage("base_policy"):
        network = train_classifier(clocked, settings.classifier_steps, problem.seed)
    with problem.stage("score"):
        bad = suboptimality(clocked, lacks(clocked, network))
        chunks = cut(clocked, standardised(transitions.actions))
        repeated = duplicated(chunks, target_rows(problem), settings.duplicate_similarity)
    return Scored(transitions, bad, chunks, repeated)


def clocked_steps(transitions: Transitions, dt: FloatArray) -> Clocked:
    """Standardised states of the pool with their times; `dt` (candidates,) is in s."""
    step = units(transitions.lengths, dt)
    return Clocked(standardised(transitions.observations), transitions.starts, transitions.lengths, step)


def kept_steps(found: Scored, kept_share: float) -> Mask:
    """Steps (steps,) at which a window may begin.

    A candidate of which anything is kept keeps its last step: without those nothing would teach to stop.
    """
    transitions = found.transitions
    good = found.suboptimality <= np.quantile(found.suboptimality, kept_share)
    kept = np.asarray(good & ~found.duplicate[found.chunks.of_step])
    last: IntArray = transitions.starts + transitions.lengths - 1
    kept[last] |= np.logical_or.reduceat(kept, transitions.starts)
    return kept
