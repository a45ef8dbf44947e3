"""CUPID (Agia et al., CoRL 2025): demonstrations by their influence on the return of a policy trained on all.

What follows the paper: a base policy, trained here on the whole pool; rollouts of it with return +1 or -1;
Psi(demonstration) = g_J^T H^-1 (mean gradient of the demonstration's log-likelihood), g_J the policy gradient
estimated from the rollouts by their returns; the lowest Psi are dropped, the highest kept.

What the paper leaves to the task: policies of this project are deterministic and the gradient at their own
action is zero, so actions are sampled around it, as spread as the demonstrations' are. Length varies, so
gradients are means over steps; `aggregation="sum"` and `output="square"` are the release's.

With returns all alike the expected policy gradient is zero and its estimate is noise. A target whose
rollouts nearly all end alike (share of successes outside SHARES) is therefore ranked by the return on all
targets. Where that is as one-sided, the ranking stands but says little: the base policy needs more `steps`.
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from pydantic import Field

from plancurate.tasks.curation.pool import Pool
from plancurate.tasks.curation.selectors.base import Kept, Problem, Settings, selector
from plancurate.tasks.curation.selectors.influence import (
    Aggregation,
    Gradients,
    Hessian,
    Network,
    Output,
    draw_projections,
    gram,
    trajectory_gradients,
)
from plancurate.tasks.curation.selectors.ranking import Scope, lowest_of_scope
from plancurate.tasks.curation.selectors.transitions import target_rows
from plancurate.tasks.learning.demonstrations import (
    Demonstrations,
    Float32Array,
    FloatArray,
    IntArray,
    demonstrations,
)
from plancurate.tasks.learning.policies.batches import standardised
from plancurate.tasks.learning.policies.trained import Normaliser, TrainedPolicy
from plancurate.tasks.learning.rollouts import EvaluateSettings, Trials
from plancurate.tasks.learning.test_targets import directions
from plancurate.tasks.learning.train import TrainSettings, train

Objective = Literal["target", "all"]
SHARES = (0.05, 0.95)
"""Shares of successful rollouts between which returns tell good actions from bad ones."""
DISPLACED_M = 0.05
"""Largest displacement of a rollout's target from the training target."""
LEAST_SIGMA = 0.05
"""Standard deviation at least of sampled actions, in standardised units."""


class InfluenceSettings(Settings):
    """How influence is computed."""

    output: Output = Field("loglik", description="function of the policy that gradients are of")
    aggregation: Aggregation = Field("mean", description="mean or sum over steps, of demos and rollouts")
    normalise: bool = Field(False, description="divide by the root of the self-influence (RelatIF)")
    ridge: float = Field(1e-3, gt=0, description="damping of the Hessian as a share of its mean eigenvalue")
    projection: int = Field(24, ge=1, description="dimensions that each factor of a gradient is projected to")
    steps: int = Field(2000, ge=1, description="gradient steps of the base policy")
    rollouts: int = Field(100, ge=1, description="rollouts of the base policy to each target")


class CupidSettings(InfluenceSettings):
    """How influence is computed, and on what."""

    objective: Objective = Field("target", description="return on the demonstration's target or on all")


class CupidNativeSettings(InfluenceSettings):
    """How influence is computed, and how much is dropped."""

    dropped: float = Field(1 / 3, ge=0, lt=1, description="share of the pool to drop")


@selector("CUPID", CupidSettings)
def cupid(problem: Problem, settings: CupidSettings) -> Kept:
    """Keep the k trajectories of each target with the highest influence on a policy's return there."""
    return _highest(problem, influences(problem, settings, settings.objective), "target")


@selector("CUPID_Global", InfluenceSettings)
def cupid_global(problem: Problem, settings: InfluenceSettings) -> Kept:
    """Keep the k x targets trajectories with the highest influence on a policy's return, wherever they lead."""
    return _highest(problem, influences(problem, settings, "all"), "pool")


@selector("CUPID_Native", CupidNativeSettings, budgeted=False)
def cupid_native(problem: Problem, settings: CupidNativeSettings) -> Kept:
    """Keep all but the third of the pool with the lowest influence on a policy's return."""
    psi = influences(problem, settings, "all")
    with problem.stage("select"):
        best_first = np.argsort(-psi, kind="stable")
        rows = best_first[: len(psi) - math.floor(settings.dropped * len(psi))]
        return Kept(rows=rows, rank=np.arange(1, len(rows) + 1), score=psi[rows])


def _highest(problem: Problem, psi: FloatArray, scope: Scope) -> Kept:
    kept = lowest_of_scope(problem, -psi, scope)
    return replace(kept, score=psi[kept.rows])


def influences(problem: Problem, settings: InfluenceSettings, objective: Objective) -> FloatArray:
    """Psi (candidates,): change of the expected return per weight of the candidate in training; high is good."""
    with problem.stage("prepare"):
        pool, rows = problem.pool, target_rows(problem)
        paths = problem.waypoints(pool.candidates["trajectory_id"].to_pylist())
        data = demonstrations(problem.robot, paths, pool.target_positions()[rows])
    with problem.stage("base_policy"):
        trained = train("BC_MLP", [data], [problem.seed], TrainSettings(steps=settings.steps))[0]
        steps = standardised_steps(data, trained)
        policy = sampled_policy(trained, steps)
    with problem.stage("rollouts"):
        rollouts = roll_out(problem, policy, settings.rollouts)
    with problem.stage("score"):
        return score(policy, steps, rows, rollouts, pool.n_targets, settings, objective, problem.seed)


@dataclass(frozen=True, eq=False)
class Steps:
    """Standardised steps of trajectories, one trajectory after another."""

    observations: Float32Array
    """(steps, o)."""
    actions: Float32Array
    """(steps, n)."""
    starts: IntArray
    """(trajectories,): first step of each."""
    lengths: IntArray
    """(trajectories,): steps of each."""


@dataclass(frozen=True, eq=False)
class Rollouts:
    """What a policy with sampled actions did, and what came of it."""

    steps: Steps
    """Up to the success or failure of each rollout."""
    returns: FloatArray
    """(rollouts,): 1 for a success, -1 for a failure."""
    target: IntArray
    """(rollouts,): row of the training target that the rollout's own target lies near."""


@dataclass(frozen=True, eq=False)
class SampledPolicy:
    """N(mu(s), sigma^2 I) around a trained policy's action mu, in standardised units."""

    network: Network
    sigma: float
    normaliser: Normaliser

    def sample(self, observations: FloatArray, rng: np.random.Generator) -> tuple[Float32Array, Float32Array]:
        """Standardised observations (b, o) and actions (b, n) drawn for them, given observations in m and rad."""
        norm = self.normaliser
        seen = (observations - norm.observation_mean.numpy()) / norm.observation_scale.numpy()
        mu = self.network.act(seen.astype(np.float32))
        noise = rng.normal(0, self.sigma, mu.shape)
        return seen.astype(np.float32), (mu + noise).astype(np.float32)

    def differences(self, actions: Float32Array) -> FloatArray:
        """Differences (b, n) to the present joint angles, rad or m, that standardised actions stand for."""
        norm = self.normaliser
        return np.asarray(actions * norm.action_scale.numpy() + norm.action_mean.numpy(), dtype=np.float64)


def standardised_steps(data: Demonstrations, trained: TrainedPolicy) -> Steps:
    """The steps that the policy was trained on, held ones included, as it saw them."""
    table = standardised(data, trained.normaliser, trained.action).numpy()
    observed = data.observations.shape[1]
    return Steps(table[:, :observed], table[:, observed:], data.starts, data.lengths)


def sampled_policy(trained: TrainedPolicy, steps: Steps) -> SampledPolicy:
    """The trained BC_MLP with actions as spread around its own as those of the steps it was trained on."""
    count = len(trained.weights) // 2
    names = [f"layer_{k}" for k in range(count)]
    network = Network(
        tuple(
            (trained.weights[f"{name}.weight"].numpy(), trained.weights[f"{name}.bias"][0].numpy())
            for name in names
        )
    )
    residual = steps.actions - network.act(steps.observations)
    sigma = float(np.sqrt(np.mean(np.square(residual, dtype=np.float64))))
    return SampledPolicy(network, max(sigma, LEAST_SIGMA), trained.normaliser)


def roll_out(problem: Problem, policy: SampledPolicy, each: int) -> Rollouts:
    """Roll the policy out from home, `each` times to positions around every target of the pool."""
    settings = EvaluateSettings()
    rng = np.random.default_rng(_own_seed(problem.seed))
    positions = own_targets(problem.pool, each, problem.seed)
    trials = Trials(problem.robot, problem.scene, positions, settings)
    seen, done, lengths = [], [], np.zeros(len(positions), dtype=np.int64)
    for _ in range(settings.max_steps):
        observations, actions = policy.sample(trials.observations(), rng)
        seen.append(observations)
        done.append(actions)
        lengths += ~(trials.reached | trials.stopped)
        trials.move(trials.q + policy.differences(actions))
        if (trials.reached | trials.stopped).all():
            break
    return Rollouts(
        steps=_joined(seen, done, lengths),
        returns=np.where(trials.reached, 1.0, -1.0),
        target=np.repeat(np.arange(problem.pool.n_targets), each),
    )


def _joined(seen: list[Float32Array], done: list[Float32Array], lengths: IntArray) -> Steps:
    """The first steps of each rollout (lengths), from arrays (rollouts, ...) of all rollouts at each step."""
    taken = np.arange(len(seen))[None, :] < lengths[:, None]
    observations, actions = (np.stack(values, axis=1)[taken] for values in (seen, done))
    return Steps(observations, actions, np.cumsum(lengths) - lengths, lengths)


def own_targets(pool: Pool, each: int, seed: int) -> FloatArray:
    """Positions (targets * each, 3), m, displaced evenly up to DISPLACED_M, in directions of no evaluation."""
    distance = np.linspace(DISPLACED_M / each, DISPLACED_M, each)[:, None]  # tests in place are evaluation's
    ids = pool.targets["target_id"].to_pylist()
    return np.concatenate(
        [
            position + distance * directions(each, _own_seed(seed), target_id)
            for position, target_id in zip(pool.target_positions(), ids, strict=True)
        ]
    )


def _own_seed(seed: int) -> int:
    """A seed beyond those that anyone gives to an evaluation, so that no test leaks into the selection."""
    return int.from_bytes(hashlib.sha256(f"CUPID/{seed}".encode()).digest()[:16], "little")


def score(
    policy: SampledPolicy,
    demos: Steps,
    target: IntArray,
    rollouts: Rollouts,
    n_targets: int,
    settings: InfluenceSettings,
    objective: Objective,
    seed: int,
) -> FloatArray:
    """Psi (demos,) of demonstrations that lead to targets in the given rows (demos,)."""
    projections = draw_projections(policy.network, settings.projection, np.random.default_rng(seed))
    gradients = Gradients(policy.network, projections, settings.output, policy.sigma)
    of_rollouts = _of_trajectories(gradients, rollouts.steps, settings.aggregation)
    shown = gradients.factors(demos.observations, demos.actions)
    of_demos = trajectory_gradients(shown, demos.starts, demos.lengths, settings.aggregation)
    hessian = Hessian(gram(shown), settings.ridge)
    of_return = return_gradients(of_rollouts, rollouts.returns, rollouts.target, n_targets, objective)
    psi = np.einsum("cd,cd->c", of_demos, hessian.solve(of_return)[target])
    return np.asarray(psi / np.sqrt(hessian.self_influence(of_demos)) if settings.normalise else psi)


def _of_trajectories(gradients: Gradients, steps: Steps, aggregation: Aggregation) -> FloatArray:
    factors = gradients.factors(steps.observations, steps.actions)
    return trajectory_gradients(factors, steps.starts, steps.lengths, aggregation)


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
