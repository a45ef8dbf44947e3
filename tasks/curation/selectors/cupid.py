"""CUPID (Agia et al., CoRL 2025): demonstrations by their influence on the return of a policy trained on all.

What follows the paper: a base policy, trained on the whole pool as the study trains its policies; rollouts of it
with return +1 or -1; Psi(demonstration) = g_J^T H^-1 (mean gradient of the demonstration's log-likelihood), g_J
the policy gradient estimated from the rollouts by their returns; the lowest Psi are dropped, the highest kept.

What the paper leaves to the task: policies of this project are deterministic and the gradient at their own
action is zero, so actions are sampled around it, as spread as the demonstrations' are. Length varies, so
gradients are means over steps; `aggregation="sum"` and `output="square"` are the release's.

With returns all alike the expected policy gradient is zero and its estimate is noise. A target whose
rollouts nearly all end alike (share of successes outside SHARES) is therefore ranked by the return on all
targets. Where that is as one-sided, the ranking stands but says little: the base policy needs more `steps`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from pydantic import Field

from plancurate.tasks.curation.learning_settings import Used
from plancurate.tasks.curation.selectors.base import Kept, Problem, Settings, selector
from plancurate.tasks.curation.selectors.influence import (
    Aggregation,
    Gradients,
    Hessian,
    Output,
    draw_projections,
    gram,
    trajectory_gradients,
)
from plancurate.tasks.curation.selectors.ranking import highest_of_all, highest_of_scope, split_half
from plancurate.tasks.curation.selectors.sampled_policy import (
    Rollouts,
    SampledPolicy,
    Steps,
    base_policy,
    pool_demonstrations,
    roll_out,
    sampled_policy,
    standardised_steps,
)
from plancurate.tasks.curation.selectors.transitions import target_rows
from plancurate.tasks.learning.demonstrations import FloatArray, IntArray
from plancurate.tasks.learning.settings import TrainSettings

Objective = Literal["target", "all"]
SHARES = (0.05, 0.95)
"""Shares of successful rollouts between which returns tell good actions from bad ones."""
AT_ONCE = 256
"""Trajectories whose steps' gradients are held at once."""
USES: tuple[Used, ...] = ("training", "evaluation", "timing")


class InfluenceSettings(Settings):
    """How influence is computed."""

    output: Output = Field("loglik", description="function of the policy that gradients are of")
    aggregation: Aggregation = Field("mean", description="mean or sum over steps, of demos and rollouts")
    normalise: bool = Field(False, description="divide by the root of the self-influence (RelatIF)")
    ridge: float = Field(1e-3, gt=0, description="damping of the Hessian as a share of its mean eigenvalue")
    projection: int = Field(24, ge=1, description="dimensions that each factor of a gradient is projected to")
    steps: int | None = Field(
        None, ge=1, description="gradient steps of the base policy; by default those of the study"
    )
    rollouts: int = Field(
        100, ge=2, description="rollouts of the base policy to each target; more give a steadier order"
    )


class CupidSettings(InfluenceSettings):
    """How influence is computed, and on what."""

    objective: Objective = Field("target", description="return on the demonstration's target or on all")


class CupidNativeSettings(InfluenceSettings):
    """How influence is computed, and how much is dropped."""

    dropped: float = Field(1 / 3, ge=0, lt=1, description="share of the pool to drop")


@dataclass(frozen=True, eq=False)
class Influence:
    """Psi of c candidates: change of the expected return per weight of the candidate in training; high is good."""

    psi: FloatArray
    """(c,)."""
    halves: tuple[FloatArray, FloatArray]
    """(c,) each: by every other rollout to each target alone, and by the rest."""


@selector("CUPID", CupidSettings, estimated=True, uses=USES, revision=3)
def cupid(problem: Problem, settings: CupidSettings) -> Kept:
    """Keep the k trajectories of each target with the highest influence on a policy's return there."""
    found = influences(problem, settings, settings.objective)
    kept = highest_of_scope(problem, found.psi, "target")
    return replace(kept, split_half=split_half(found.halves, target_rows(problem)))


@selector("CUPID_Global", InfluenceSettings, estimated=True, uses=USES, revision=3)
def cupid_global(problem: Problem, settings: InfluenceSettings) -> Kept:
    """Keep the k x targets trajectories with the highest influence on a policy's return, wherever they lead."""
    found = influences(problem, settings, "all")
    kept = highest_of_scope(problem, found.psi, "pool")
    return replace(kept, split_half=split_half(found.halves, np.zeros(len(found.psi), np.int64)))


@selector("CUPID_Native", CupidNativeSettings, budgeted=False, estimated=True, uses=USES, revision=3)
def cupid_native(problem: Problem, settings: CupidNativeSettings) -> Kept:
    """Keep all but the third of the pool with the lowest influence on a policy's return."""
    found = influences(problem, settings, "all")
    count = len(found.psi)
    kept = highest_of_all(problem, found.psi, count - math.floor(settings.dropped * count))
    return replace(kept, split_half=split_half(found.halves, np.zeros(count, np.int64)))


def influences(problem: Problem, settings: InfluenceSettings, objective: Objective) -> Influence:
    """Influence of all candidates of the pool, whatever the budget is."""
    what = tuple(getattr(settings, name) for name in InfluenceSettings.model_fields)
    return problem.once(("CUPID", what), lambda: estimated_influences(problem, settings))[objective]


def estimated_influences(problem: Problem, settings: InfluenceSettings) -> dict[Objective, Influence]:
    """Train the base policy, roll it out, and estimate the influence of all candidates on either objective."""
    with problem.stage("prepare"):
        data = pool_demonstrations(problem)
    with problem.stage("base_policy"):
        trained = base_policy(problem, data, base_training(problem, settings))
        steps = standardised_steps(data, trained)
        policy = sampled_policy(trained, steps)
    with problem.stage("rollouts"):
        rollouts = roll_out(problem, policy, settings.rollouts)
    with problem.stage("score"):
        rows, n_targets = target_rows(problem), problem.pool.n_targets
        return score(policy, steps, rows, rollouts, n_targets, settings, problem.seed)


def base_training(problem: Problem, settings: InfluenceSettings) -> TrainSettings:
    """How the base policy is trained: as the study's policies are, unless the selector's own `steps` say other."""
    training = problem.learning.training
    return training if settings.steps is None else training.model_copy(update={"steps": settings.steps})


def score(
    policy: SampledPolicy,
    demos: Steps,
    target: IntArray,
    rollouts: Rollouts,
    n_targets: int,
    settings: InfluenceSettings,
    seed: int,
) -> dict[Objective, Influence]:
    """Influence, on either objective, of demonstrations that lead to targets in the given rows (demos,)."""
    projections = draw_projections(policy.network, settings.projection, np.random.default_rng(seed))
    gradients = Gradients(policy.network, projections, settings.output, policy.sigma)
    of_rollouts = _of_trajectories(gradients, rollouts.steps, settings.aggregation)
    of_demos = _of_trajectories(gradients, demos, settings.aggregation)
    hessian = Hessian(gram(gradients, demos.observations, demos.actions), settings.ridge)
    scale = np.sqrt(hessian.self_influence(of_demos)) if settings.normalise else 1.0

    def psi(objective: Objective, which: slice) -> FloatArray:
        returns, reached_for = rollouts.returns[which], rollouts.target[which]
        of_return = return_gradients(of_rollouts[which], returns, reached_for, n_targets, objective)
        return np.asarray(np.einsum("cd,cd->c", of_demos, hessian.solve(of_return)[target]) / scale)

    every, one_half, other_half = slice(None), slice(0, None, 2), slice(1, None, 2)
    return {
        objective: Influence(psi(objective, every), (psi(objective, one_half), psi(objective, other_half)))
        for objective in get_args(Objective)
    }


def _of_trajectories(gradients: Gradients, steps: Steps, aggregation: Aggregation) -> FloatArray:
    """Gradients (trajectories, d) of whole trajectories, some at once: factors of all steps would fill gigabytes."""
    some = [slice(first, first + AT_ONCE) for first in range(0, len(steps.starts), AT_ONCE)]
    return np.concatenate([_of_some(gradients, steps, trajectories, aggregation) for trajectories in some])


def _of_some(gradients: Gradients, steps: Steps, trajectories: slice, aggregation: Aggregation) -> FloatArray:
    starts, lengths = steps.starts[trajectories], steps.lengths[trajectories]
    theirs = slice(starts[0], starts[-1] + lengths[-1])
    factors = gradients.factors(steps.observations[theirs], steps.actions[theirs])
    return trajectory_gradients(factors, starts - starts[0], lengths, aggregation)


def return_gradients(
    gradients: FloatArray, returns: FloatArray, target: IntArray, n_targets: int, objective: Objective
) -> FloatArray:
    """Policy gradients g_J (targets, d): mean of return times gradient (rollouts, d) over rollouts (REINFORCE).

    Over the rollouts to a target where the objective is its own and both outcomes occur, over all elsewhere.
    """
    weighted = returns[:, None] * gradients
    found = np.tile(weighted.mean(axis=0), (n_targets, 1))
    if objective == "all":
        return found
    for row in range(n_targets):
        here = target == row
        if SHARES[0] < np.mean(returns[here] > 0) < SHARES[1]:
            found[row] = weighted[here].mean(axis=0)
    return found
