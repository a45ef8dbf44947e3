"""DemInf: what adds to the mutual information of states and actions is worth training on.

Hejna, Mirchandani, Balakrishna, Xie, Wahid, Tompson, Sanketi, Shah, Devin, Sadigh: Robot Data Curation with Mutual
Information Estimators, RSS 2025. A step counts for much where its action follows from its state, while the
actions elsewhere are others. No policy is trained and nothing is rolled out.

The authors embed images and chunks of actions in autoencoders first; here states (the way to the target and the
joint positions) and chunks of actions (joint steps) are small vectors and are compared as they are, standardised.
As theirs are, batches are drawn from the whole pool: among the steps to one target alone what is rare stands out as
informative, and candidates that lead elsewhere come first instead of last.
"""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from plancurate.tasks.curation.selectors.base import Kept, Problem, Settings, selector
from plancurate.tasks.curation.selectors.mutual_information import contributions
from plancurate.tasks.curation.selectors.ranking import highest_of_all, highest_of_scope
from plancurate.tasks.curation.selectors.transitions import Transitions, load_transitions, standardised
from plancurate.tasks.learning.demonstrations import Float32Array, FloatArray

NEIGHBOURS = (5, 6, 7)
"""Numbers of neighbours over which the estimate is averaged, as in the authors' experiments."""
CLIPPED_PERCENT = (1, 99)
"""Percentiles to which the steps' values are clipped, as in the authors' code."""


class DemInfSettings(Settings):
    """How the information is estimated."""

    chunk: int = Field(4, ge=1, description="steps, from the present one on, that an action is made of")
    batch: int = Field(1024, ge=16, description="steps among which neighbours are sought")
    repeats: int = Field(4, ge=1, description="random divisions of the steps into batches, averaged over")


class DemInfNativeSettings(DemInfSettings):
    """How the information is estimated, and how much is kept."""

    kept_share: float = Field(0.5, gt=0, le=1, description="share of the pool to keep, the highest")


@selector("DemInf", DemInfSettings)
def deminf(problem: Problem, settings: DemInfSettings) -> Kept:
    """Keep the k trajectories of each target whose steps add most to what states tell of actions."""
    return highest_of_scope(problem, information(problem, settings), "target")


@selector("DemInf_Native", DemInfNativeSettings, budgeted=False)
def deminf_native(problem: Problem, settings: DemInfNativeSettings) -> Kept:
    """Keep the half of the pool whose steps add most to what states tell of actions."""
    score = information(problem, settings)
    return highest_of_all(problem, score, math.ceil(settings.kept_share * len(score)))


def information(problem: Problem, settings: DemInfSettings) -> FloatArray:
    """Mean of each candidate's steps (candidates,): in standard deviations of a step of the pool; high is good."""
    with problem.stage("prepare"):
        transitions = load_transitions(problem)
    with problem.stage("score"):
        states = standardised(transitions.observations)
        actions = standardised(chunks(transitions, settings.chunk))
        return transitions.mean(of_steps(states, actions, settings, np.random.default_rng(problem.seed)))


def chunks(transitions: Transitions, length: int) -> Float32Array:
    """The actions of each step and those after it (steps, length * n), the last one repeated beyond the end."""
    last = np.repeat(transitions.starts + transitions.lengths - 1, transitions.lengths)
    step = np.arange(len(last))
    return np.concatenate(
        [transitions.actions[np.minimum(step + ahead, last)] for ahead in range(length)], axis=1
    )


def of_steps(
    states: Float32Array, actions: Float32Array, settings: DemInfSettings, rng: np.random.Generator
) -> FloatArray:
    """What each step adds (steps,), clipped and standardised; 0 for all where there are too few steps to tell."""
    steps = len(states)
    if steps <= max(NEIGHBOURS):
        return np.zeros(steps)
    total = np.zeros(steps)
    for _ in range(settings.repeats):
        for batch in np.array_split(rng.permutation(steps), math.ceil(steps / settings.batch)):
            total[batch] += contributions(states[batch], actions[batch], NEIGHBOURS)
    value = np.clip(total / settings.repeats, *np.percentile(total / settings.repeats, CLIPPED_PERCENT))
    spread = value.std()
    return np.asarray((value - value.mean()) / (spread if spread > 0 else 1.0))
