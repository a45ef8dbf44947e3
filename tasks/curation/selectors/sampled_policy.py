"""A policy that draws its actions, and rollouts of it: what an influence on the return is estimated from."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np

from plancurate.tasks.curation.pool import Pool
from plancurate.tasks.curation.selectors.base import Problem
from plancurate.tasks.curation.selectors.influence import Network
from plancurate.tasks.curation.selectors.networks import one_thread
from plancurate.tasks.curation.selectors.transitions import target_rows
from plancurate.tasks.learning.demonstrations import (
    Demonstrations,
    Float32Array,
    FloatArray,
    IntArray,
    demonstrations,
)
from plancurate.tasks.learning.observations import observe
from plancurate.tasks.learning.policies.batches import standardised
from plancurate.tasks.learning.policies.mlp import MLPPolicy
from plancurate.tasks.learning.policies.trained import TrainedPolicy
from plancurate.tasks.learning.rollouts import Trials
from plancurate.tasks.learning.settings import TrainSettings
from plancurate.tasks.learning.test_targets import directions
from plancurate.tasks.learning.train import train

DISPLACED_M = 0.05
"""Largest displacement of a rollout's target from the training target."""
LEAST_SIGMA = 0.05
"""Standard deviation at least of sampled actions, in standardised units."""


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
    trained: TrainedPolicy

    def sample(self, observations: FloatArray, noise: FloatArray) -> tuple[Float32Array, Float32Array]:
        """Standardised observations (b, o) and actions (b, n), given observations and standard normal draws (b, n)."""
        norm = self.trained.normaliser
        seen = (observations - norm.observation_mean.numpy()) / norm.observation_scale.numpy()
        mu = self.network.act(seen.astype(np.float32))
        return seen.astype(np.float32), (mu + self.sigma * noise).astype(np.float32)

    def next_q(self, actions: Float32Array, q: FloatArray) -> FloatArray:
        """Joint angles (b, n) that standardised actions lead to from joint angles q (b, n), rad or m."""
        norm = self.trained.normaliser
        action = np.asarray(actions * norm.action_scale.numpy() + norm.action_mean.numpy(), dtype=np.float64)
        return q + action if self.trained.action == "delta" else action


def standardised_steps(data: Demonstrations, trained: TrainedPolicy) -> Steps:
    """The steps that the policy was trained on, held ones included, as it saw them."""
    table = standardised(data, trained.normaliser, trained.action).numpy()
    observed = data.observations.shape[1]
    return Steps(table[:, :observed], table[:, observed:], data.starts, data.lengths)


def pool_demonstrations(problem: Problem) -> Demonstrations:
    """All candidates of the pool as the study's policies would be shown them."""
    pool = problem.pool
    paths = problem.waypoints(pool.candidates["trajectory_id"].to_pylist())
    targets = pool.target_positions()[target_rows(problem)]
    return demonstrations(problem.robot, problem.scene, paths, targets, problem.learning.training)


def base_policy(problem: Problem, data: Demonstrations, settings: TrainSettings) -> TrainedPolicy:
    """Train a BC_MLP on demonstrations from the selection's seed: on any number of cores the same one."""
    with one_thread():
        return train("BC_MLP", [data], [problem.seed], settings)[0]


def network_of(trained: TrainedPolicy) -> Network:
    """The perceptron of a trained BC_MLP."""
    assert isinstance(trained.policy, MLPPolicy)
    layers = [f"layer_{k}" for k in range(len(trained.policy.hidden) + 1)]
    return Network(
        tuple(
            (trained.weights[f"{name}.weight"].numpy(), trained.weights[f"{name}.bias"][0].numpy())
            for name in layers
        ),
        trained.policy.activation,
    )


def sampled_policy(trained: TrainedPolicy, steps: Steps) -> SampledPolicy:
    """The trained BC_MLP with actions as spread around its own as those of the steps it was trained on."""
    network = network_of(trained)
    residual = steps.actions - network.act(steps.observations)
    sigma = float(np.sqrt(np.mean(np.square(residual, dtype=np.float64))))
    return SampledPolicy(network, max(sigma, LEAST_SIGMA), trained)


def roll_out(problem: Problem, policy: SampledPolicy, each: int) -> Rollouts:
    """Roll the policy out from home, `each` times to positions around every target of the pool."""
    settings, dt = problem.learning.evaluation, problem.learning.timing.dt
    rng = np.random.default_rng(_own_seed(problem.seed))
    positions = own_targets(problem.pool, each, problem.seed)
    shown = (
        policy.trained.goals
    )  # where a term needs goals, those of near training targets do without a search
    goals = None if shown is None else shown.at(positions)
    trials = Trials(problem.robot, problem.scene, positions, settings, dt, goals)
    terms = [name for name, _ in policy.trained.layout]
    taken = []
    for _ in range(settings.max_steps):
        under_way = np.flatnonzero(~(trials.reached | trials.stopped))
        # Drawn for all, so that what one rollout does hangs on no other one's end.
        noise = rng.standard_normal(trials.state.q.shape)[under_way]
        seen, actions = policy.sample(observe(terms, trials.state.take(under_way)), noise)
        asked = trials.state.q.copy()
        asked[under_way] = policy.next_q(actions, asked[under_way])
        taken.append((under_way, seen, actions))
        trials.move(asked)
        if (trials.reached | trials.stopped).all():
            break
    return Rollouts(
        steps=_in_order(taken, len(positions)),
        returns=np.where(trials.reached, 1.0, -1.0),
        target=np.repeat(np.arange(problem.pool.n_targets), each),
    )


def _in_order(taken: list[tuple[IntArray, Float32Array, Float32Array]], rollouts: int) -> Steps:
    """One rollout after another, from the rows, observations and actions of those that were under way at each step."""
    rows, observations, actions = (np.concatenate(values) for values in zip(*taken, strict=True))
    order = np.argsort(rows, kind="stable")
    lengths = np.bincount(rows, minlength=rollouts)
    return Steps(observations[order], actions[order], np.cumsum(lengths) - lengths, lengths)


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
