from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import duckdb
import numpy as np
import pytest
import torch
from scipy.special import erf
from scipy.stats import spearmanr

from plancurate.tasks.candidates.targets import Target
from plancurate.tasks.curation.learning_settings import LearningSettings
from plancurate.tasks.curation.selectors import base, cupid
from plancurate.tasks.curation.selectors import sampled_policy as cupid_rollouts
from plancurate.tasks.curation.selectors.base import Problem, Stopwatch
from plancurate.tasks.curation.selectors.cupid import InfluenceSettings
from plancurate.tasks.curation.selectors.influence import (
    Activation,
    Gradients,
    Hessian,
    Network,
    draw_projections,
    gram,
    trajectory_gradients,
)
from plancurate.tasks.curation.selectors.ranking import split_half
from plancurate.tasks.curation.selectors.sampled_policy import (
    DISPLACED_M,
    Rollouts,
    SampledPolicy,
    Steps,
    own_targets,
    roll_out,
    sampled_policy,
    standardised_steps,
)
from plancurate.tasks.curation.selectors.selection import Selection, select
from plancurate.tasks.curation.selectors.transitions import target_rows
from plancurate.tasks.learning.demonstrations import Demonstrations, demonstrations
from plancurate.tasks.learning.policies.trained import TrainedPolicy
from plancurate.tasks.learning.rollouts import Trials
from plancurate.tasks.learning.settings import EvaluateSettings, TrainSettings
from plancurate.tasks.learning.test_targets import displaced_tests
from plancurate.tasks.learning.train import train

from .defects import LEARNING, ROBOT, SCENE, Bed, auroc, chosen, defective_pool

pytestmark = pytest.mark.training

TARGETS = 6
QUICK = {"steps": 300, "rollouts": 10, "projection": 8}


@dataclass(frozen=True)
class Worked:
    """A pool with defects, a policy trained on it and its rollouts."""

    bed: Bed
    problem: Problem
    data: Demonstrations
    trained: TrainedPolicy
    policy: SampledPolicy
    steps: Steps
    rollouts: Rollouts

    def psi(self, objective: cupid.Objective = "target", **params: object) -> np.ndarray:
        """Influence of all candidates."""
        return self.influence(objective, **params).psi

    def influence(self, objective: cupid.Objective = "target", **params: object) -> cupid.Influence:
        """Influence of all candidates, by all rollouts and by halves of them."""
        settings = InfluenceSettings.model_validate(params)
        rows = target_rows(self.problem)
        return cupid.score(
            self.policy, self.steps, rows, self.rollouts, TARGETS, settings, self.problem.seed
        )[objective]


def problem_of(bed: Bed) -> Problem:
    watch = Stopwatch(time.perf_counter)
    return Problem(bed.pool, 5, 1, duckdb.connect(), watch, ROBOT, SCENE, bed.waypoints, LEARNING)


@pytest.fixture(scope="module")
def worked() -> Worked:
    bed = defective_pool(seed=1, targets=TARGETS, per_target=40)
    problem = problem_of(bed)
    data = demonstrations(ROBOT, SCENE, bed.paths, bed.pool.target_positions()[target_rows(problem)])
    trained = train("BC_MLP", [data], [problem.seed], TrainSettings(steps=1000))[0]
    steps = standardised_steps(data, trained)
    policy = sampled_policy(trained, steps)
    return Worked(bed, problem, data, trained, policy, steps, roll_out(problem, policy, 300))


def run(
    name: str,
    bed: Bed,
    budget: int | None = 5,
    seed: int = 0,
    learning: LearningSettings = LEARNING,
    **params: object,
) -> Selection:
    chosen = {**QUICK, **params} if name.startswith("CUPID") else params
    return select(
        name, bed.pool, budget, seed, chosen,
        robot=ROBOT, scene=SCENE, waypoints=bed.waypoints, learning=learning,
    )  # fmt: skip


def small_network(rng: np.random.Generator) -> Network:
    sizes = (5, 7, 6, 3)
    return Network(
        tuple(
            (rng.normal(0, 0.5, shape).astype(np.float32), rng.normal(0, 0.1, shape[1]).astype(np.float32))
            for shape in pairwise(sizes)
        )
    )


def small_steps(rng: np.random.Generator, network: Network, trajectories: int) -> Steps:
    """Steps whose actions scatter around the network's."""
    lengths = rng.integers(3, 12, trajectories)
    observations = rng.normal(size=(lengths.sum(), 5)).astype(np.float32)
    actions = network.act(observations) + rng.normal(0, 0.5, (lengths.sum(), 3)).astype(np.float32)
    return Steps(observations, actions, np.cumsum(lengths) - lengths, lengths)


def of_trajectories(gradients: Gradients, steps: Steps) -> np.ndarray:
    factors = gradients.factors(steps.observations, steps.actions)
    return trajectory_gradients(factors, steps.starts, steps.lengths, "mean")


@pytest.mark.parametrize("activation", ["tanh", "relu"])
def test_gradients_are_those_of_the_log_likelihood(activation: Activation) -> None:
    rng = np.random.default_rng(0)
    network, sigma = replace(small_network(rng), activation=activation), 0.7
    bend = torch.tanh if activation == "tanh" else torch.relu
    steps = small_steps(rng, network, 4)
    found = of_trajectories(Gradients(network, draw_projections(network, None, rng), "loglik", sigma), steps)
    layers = [[torch.tensor(part, requires_grad=True) for part in layer] for layer in network.layers]
    for row, (first, length) in enumerate(zip(steps.starts, steps.lengths, strict=True)):
        x = torch.from_numpy(steps.observations[first : first + length])
        for k, (weight, bias) in enumerate(layers):
            x = x @ weight + bias if k == len(layers) - 1 else bend(x @ weight + bias)
        actions = torch.from_numpy(steps.actions[first : first + length])
        likelihood = -((actions - x) ** 2).sum(1).mean() / (2 * sigma**2)
        grads = torch.autograd.grad(likelihood, [part for layer in layers for part in layer])
        pairs = zip(grads[::2], grads[1::2], strict=True)
        expected = [torch.cat([weight, bias[None]]).T.flatten() for weight, bias in pairs]
        np.testing.assert_allclose(found[row], torch.cat(expected).numpy(), atol=1e-5)


def test_a_policys_own_actions_have_no_gradient() -> None:
    rng = np.random.default_rng(1)
    network = small_network(rng)
    steps = small_steps(rng, network, 3)
    own = replace(steps, actions=network.act(steps.observations))
    gradients = Gradients(network, draw_projections(network, None, rng), "loglik", 0.5)
    assert np.abs(of_trajectories(gradients, own)).max() < 1e-5
    assert np.abs(of_trajectories(gradients, steps)).max() > 0.1


def test_projections_that_are_large_enough_change_nothing_and_smaller_ones_little() -> None:
    rng = np.random.default_rng(2)
    network = small_network(rng)
    steps, others = small_steps(rng, network, 80), small_steps(rng, network, 40)
    returns = rng.choice([-1.0, 1.0], 40)
    scores = []
    for size in (None, 8, 6):
        gradients = Gradients(network, draw_projections(network, size, rng), "loglik", 0.5)
        hessian = Hessian(gram(gradients, steps.observations, steps.actions), 1e-3)
        objective = (returns[:, None] * of_trajectories(gradients, others)).mean(0, keepdims=True)
        scores.append(of_trajectories(gradients, steps) @ hessian.solve(objective)[0])
    np.testing.assert_allclose(scores[1], scores[0], rtol=1e-2, atol=1e-3 * np.abs(scores[0]).max())
    assert spearmanr(scores[0], scores[1]).statistic > 0.999
    assert spearmanr(scores[0], scores[2]).statistic > 0.8


def expected_return(coefficients: np.ndarray, x: np.ndarray, aim: np.ndarray, sigma: float) -> float:
    """Mean return over states x of actions N(mu, sigma^2), 1 within 0.5 of the aim and -1 elsewhere."""
    off = aim - x @ coefficients
    inside = [erf((off + side) / sigma / 2**0.5) / 2 for side in (-0.5, 0.5)]
    return float(np.mean(2 * (inside[1] - inside[0]) - 1))


def test_influence_on_a_linear_policy_is_the_change_of_the_return_after_training_again() -> None:
    rng = np.random.default_rng(3)
    sigma, demos, truth = 0.5, 60, rng.normal(size=(5, 1))
    lengths = rng.integers(20, 60, demos)
    x = np.column_stack([rng.normal(size=(lengths.sum(), 4)), np.ones(lengths.sum())])
    y = x @ truth + rng.normal(0, sigma, (len(x), 1))
    fitted = np.linalg.lstsq(x, y, rcond=None)[0]
    network = Network(((fitted[:-1].astype(np.float32), fitted[-1].astype(np.float32)),))
    steps = Steps(x[:, :4].astype(np.float32), y.astype(np.float32), np.cumsum(lengths) - lengths, lengths)

    states = np.column_stack([rng.normal(1, 1, (100, 4)), np.ones(100)])
    aim = states @ (truth + np.array([[0.4], [-0.2], [0.0], [0.3], [0.2]]))
    tried = np.repeat(np.arange(100), 2000)
    acted = (states @ fitted)[tried] + rng.normal(0, sigma, (len(tried), 1))
    returns = np.where(np.abs(acted - aim[tried]) < 0.5, 1.0, -1.0)[:, 0]

    gradients = Gradients(network, draw_projections(network, None, rng), "loglik", sigma)
    seen = states[tried, :4].astype(np.float32)
    rollouts = Steps(seen, acted.astype(np.float32), np.arange(len(tried)), np.ones(len(tried), np.int64))
    of_return = cupid.return_gradients(
        of_trajectories(gradients, rollouts), returns, np.zeros(len(tried), int), 1, "all"
    )
    hessian = Hessian(gram(gradients, steps.observations, steps.actions), 1e-9)
    psi = of_trajectories(gradients, steps) @ hessian.solve(of_return)[0]

    change, epsilon = np.empty(demos), 1e-3
    for demo in range(demos):
        weight = np.ones((len(x), 1))
        weight[steps.starts[demo] : steps.starts[demo] + lengths[demo]] += epsilon / lengths[demo]
        again = np.linalg.solve((weight * x).T @ x, (weight * x).T @ y)
        moved = expected_return(again, states, aim, sigma) - expected_return(fitted, states, aim, sigma)
        change[demo] = moved / epsilon
    assert np.corrcoef(psi, change)[0, 1] > 0.99
    assert np.polyfit(change, psi, 1)[0] == pytest.approx(1, abs=0.1)


def test_the_network_acts_like_the_trained_policy_and_is_uncertain_like_its_demonstrations(
    worked: Worked,
) -> None:
    weights = {name: value[None] for name, value in worked.trained.weights.items()}
    expected, _ = worked.trained.policy.step(weights, torch.from_numpy(worked.steps.observations)[None], None)
    mu = worked.policy.network.act(worked.steps.observations)
    np.testing.assert_allclose(mu, expected[0].numpy(), atol=1e-5)
    assert worked.policy.sigma == pytest.approx(np.sqrt(np.mean((worked.steps.actions - mu) ** 2)), rel=1e-3)


def test_rollouts_hold_what_was_done_until_they_ended(worked: Worked) -> None:
    steps, rollouts = worked.rollouts.steps, worked.rollouts
    assert len(steps.observations) == len(steps.actions) == steps.lengths.sum()
    assert set(rollouts.returns) == {-1.0, 1.0}
    assert (steps.lengths[rollouts.returns < 0] > 0).all()
    scatter = steps.actions - worked.policy.network.act(steps.observations)
    assert scatter.std() == pytest.approx(worked.policy.sigma, rel=0.02)
    norm = worked.trained.normaliser
    mean, scale = norm.observation_mean.numpy(), norm.observation_scale.numpy()
    first = steps.observations[steps.starts[steps.lengths > 0]] * scale + mean
    np.testing.assert_allclose(first[:, 3:], np.tile(ROBOT.home, (len(first), 1)), atol=1e-4)


def test_rollouts_lead_near_the_targets_but_never_where_policies_are_tested(worked: Worked) -> None:
    pool = worked.bed.pool
    own = own_targets(pool, 50, 0).reshape(TARGETS, 50, 3)
    assert np.linalg.norm(own - pool.target_positions()[:, None], axis=2).max() <= DISPLACED_M + 1e-9
    ids = pool.targets["target_id"].to_pylist()
    targets = [
        Target(number, place, np.empty((0, 6)))
        for number, place in zip(ids, pool.target_positions(), strict=True)
    ]
    for seed in (0, 1000):
        tests = displaced_tests(targets, seed)
        apart = np.linalg.norm(own.reshape(-1, 1, 3) - tests.position[None], axis=2)
        assert apart.min() > 1e-5


def test_self_influence_is_positive(worked: Worked) -> None:
    network = worked.policy.network
    projections = draw_projections(network, 12, np.random.default_rng(0))
    gradients = Gradients(network, projections, "loglik", worked.policy.sigma)
    hessian = Hessian(gram(gradients, worked.steps.observations, worked.steps.actions), 1e-3)
    assert (hessian.self_influence(of_trajectories(gradients, worked.steps)) > 0).all()


def test_duplicates_have_the_same_influence(worked: Worked) -> None:
    psi, copies = worked.psi(projection=8), np.flatnonzero(worked.bed.twin >= 0)
    assert len(copies) > 0
    np.testing.assert_allclose(psi[copies], psi[worked.bed.twin[copies]], atol=1e-4 * psi.std())


@pytest.mark.parametrize("params", [{}, {"aggregation": "sum"}, {"normalise": True}, {"output": "square"}])
def test_opposite_returns_mean_opposite_influence(worked: Worked, params: dict[str, object]) -> None:
    flipped = replace(worked, rollouts=replace(worked.rollouts, returns=-worked.rollouts.returns))
    np.testing.assert_allclose(
        flipped.psi(projection=4, **params), -worked.psi(projection=4, **params), rtol=1e-6
    )


def test_targets_whose_rollouts_all_end_alike_are_judged_by_all_rollouts(worked: Worked) -> None:
    returns = worked.rollouts.returns.copy()
    returns[worked.rollouts.target == 1] = -1
    one_sided = replace(worked, rollouts=replace(worked.rollouts, returns=returns))
    own, shared = one_sided.psi(projection=4), one_sided.psi("all", projection=4)
    target = worked.bed.target
    np.testing.assert_array_equal(own[target == 1], shared[target == 1])
    assert (own[target != 1] != shared[target != 1]).any()


@pytest.fixture(scope="module")
def psi(worked: Worked) -> np.ndarray:
    """Influence by the default settings."""
    return worked.psi()


def test_wrong_target_labels_have_low_influence(
    worked: Worked, psi: np.ndarray, record_property: Callable[[str, object], None]
) -> None:
    area = auroc(worked.bed, -psi, "wrong_target")
    record_property("CUPID_wrong_target", round(area, 3))
    assert area > 0.6  # 0.64 to 0.71 over three seeds


def test_training_on_the_top_third_does_better_than_on_the_bottom_third(
    worked: Worked, psi: np.ndarray
) -> None:
    target = worked.bed.target
    third = np.array([np.mean(psi[target == t] < p) for p, t in zip(psi, target, strict=True)])
    places = worked.bed.pool.target_positions()[target_rows(worked.problem)]
    data = [
        demonstrations(ROBOT, SCENE, [worked.bed.paths[row] for row in rows], places[rows])
        for rows in (np.flatnonzero(third >= 2 / 3), np.flatnonzero(third < 1 / 3))
    ]
    successes = [
        np.mean(roll_out(worked.problem, sampled_policy(trained, steps), 50).returns > 0)
        for trained in train("BC_MLP", data, [0, 0], TrainSettings(steps=500))
        for steps in [standardised_steps(data[0], trained)]
    ]
    assert successes[0] > successes[1] + 0.05


def test_halves_are_disjoint_and_together_all_rollouts(worked: Worked) -> None:
    found = worked.influence("all", projection=4)
    np.testing.assert_allclose(np.mean(found.halves, axis=0), found.psi, rtol=1e-6)
    assert not np.allclose(*found.halves)


def test_more_rollouts_rank_more_stably_and_returns_by_chance_do_not(
    worked: Worked, record_property: Callable[[str, object], None]
) -> None:
    def stability(every: int, returns: np.ndarray) -> float:
        whole, which = worked.rollouts, np.s_[::every]
        steps = replace(whole.steps, starts=whole.steps.starts[which], lengths=whole.steps.lengths[which])
        some = replace(worked, rollouts=Rollouts(steps, returns[which], whole.target[which]))
        return split_half(some.influence(projection=8).halves, worked.bed.target)

    found = {300 // every: stability(every, worked.rollouts.returns) for every in (15, 1)}
    chance = stability(1, np.random.default_rng(0).permutation(worked.rollouts.returns))
    for rollouts, correlation in found.items():
        record_property(f"CUPID_split_half_{rollouts}_rollouts", round(correlation, 2))
    assert found[300] > max(found[20], chance) + 0.1


def test_each_selector_keeps_what_it_promises() -> None:
    bed = defective_pool(seed=1, targets=3, per_target=20)
    kept = run("CUPID", bed, 4).kept
    assert np.bincount(kept["target_id"].to_numpy()).tolist() == [4, 4, 4]
    for target in range(3):
        here = kept["target_id"].to_numpy() == target
        ranked = np.argsort(kept["rank"].to_numpy()[here])
        assert (np.diff(kept["score"].to_numpy()[here][ranked]) <= 0).all()
    anywhere = run("CUPID_Global", bed, 4)
    native = run("CUPID_Native", bed, None)
    assert len(anywhere.ids) == 12
    assert len(native.ids) == 40
    assert set(anywhere.ids) < set(native.ids)
    for made in (anywhere, native):
        assert made.split_half is not None
    for stage in ("prepare", "base_policy", "rollouts", "score", "select"):
        assert anywhere.seconds[stage] > 0


def test_the_same_seed_keeps_the_same_and_another_seed_something_else() -> None:
    bed = defective_pool(seed=2, targets=3, per_target=20)
    first, again = run("CUPID", bed), run("CUPID", bed)
    assert first.kept.equals(again.kept)
    assert set(first.ids) != set(run("CUPID", bed, seed=1).ids)


def test_the_base_policy_is_trained_and_rolled_out_as_the_study_says() -> None:
    bed = defective_pool(seed=2, targets=3, per_target=20)
    usual = run("CUPID_Native", bed, None, steps=None, learning=settings_of(training={"steps": 20}))
    changes = (
        {"training": {"steps": 100}},
        {"training": {"steps": 20, "observation": ["target_offset", "joint_positions", "last_action"]}},
        {"training": {"steps": 20, "action": "absolute"}},
        {"training": {"steps": 20, "policies": {"BC_MLP": {"activation": "relu"}}}},
        {"training": {"steps": 20}, "evaluation": {"max_steps": 15}},
    )
    for change in changes:
        other = run("CUPID_Native", bed, None, steps=None, learning=settings_of(**change))
        assert other.selection_id != usual.selection_id
        assert other.kept["score"] != usual.kept["score"]
    own = run("CUPID_Native", bed, None, steps=20, learning=settings_of(training={"steps": 100}))
    assert own.kept["score"] == usual.kept["score"]


def test_only_selectors_that_train_depend_on_how_the_study_trains() -> None:
    bed = defective_pool(seed=2, targets=3, per_target=20)
    short, long = (settings_of(training={"steps": steps}) for steps in (20, 100))
    ids = {
        name: {run(name, bed, learning=learning, **params).selection_id for learning in (short, long)}
        for name, params in (("CUPID", {"steps": None}), ("KMeans", {}), ("KMeans_Hybrid", {}))
    }
    assert {name: len(found) for name, found in ids.items()} == {"CUPID": 2, "KMeans": 1, "KMeans_Hybrid": 1}
    elsewhere = settings_of(training={"steps": 20, "device": "cuda"})
    cpu, cuda = (learning.identity(("training", "evaluation")) for learning in (short, elsewhere))
    assert cpu == cuda


def settings_of(
    training: dict[str, object] | None = None, evaluation: dict[str, object] | None = None
) -> LearningSettings:
    """A study's settings with some changed."""
    return LearningSettings(
        TrainSettings.model_validate(training or {}),
        EvaluateSettings.model_validate(evaluation or {}),
        LEARNING.timing,
    )


def test_the_base_policy_may_observe_goals_and_is_rolled_out_to_those_of_near_targets(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bed = defective_pool(seed=1, targets=3, per_target=6)
    given: list[np.ndarray] = []

    def noted(*arguments: Any) -> Trials:
        given.append(arguments[-1])
        return Trials(*arguments)

    monkeypatch.setattr(cupid_rollouts, "Trials", noted)
    training = TrainSettings(observation=("target_offset", "joint_positions", "goal_offset"))
    learning = LearningSettings(training, EvaluateSettings(max_steps=60), LEARNING.timing)
    kept = run("CUPID", bed, 2, learning=learning).kept
    assert np.bincount(kept["target_id"].to_numpy()).tolist() == [2, 2, 2]
    ends = np.array([path[-1] for path in bed.paths])
    goals = given[0].reshape(3, QUICK["rollouts"], 6)
    for target in range(3):  # half a centimetre away from its target a goal lies among ends that are shown
        apart = np.linalg.norm(goals[target, 0] - ends[bed.target == target], axis=1)
        assert apart.min() < 0.5
    basic = run("CUPID", bed, 2)
    assert basic.selection_id != run("CUPID", bed, 2, learning=learning).selection_id


def test_budgets_share_one_estimate_whose_time_counts_in_each(
    worked: Worked, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(base, "_made_before", OrderedDict())
    bed, trained = worked.bed, []

    def counted(*given: Any) -> TrainedPolicy:
        trained.append(given)
        return cupid_rollouts.base_policy(*given)

    monkeypatch.setattr(cupid, "base_policy", counted)
    first, more, native = (
        chosen(bed, name, budget, **QUICK)
        for name, budget in (("CUPID", 1), ("CUPID", 5), ("CUPID_Native", None))
    )
    assert len(trained) == 1
    estimated = sum(first.seconds[stage] for stage in ("base_policy", "rollouts", "score"))
    for other in (more, native):
        assert other.seconds["rollouts"] == first.seconds["rollouts"]
        assert other.selection_time_s > 0.9 * estimated  # though it took next to nothing now
    chosen(bed, "CUPID", 1, seed=1, **QUICK)
    chosen(bed, "CUPID", 1, **QUICK | {"rollouts": 11})
    assert len(trained) == 3
    base._made_before.clear()
    assert chosen(bed, "CUPID", 5, **QUICK).kept.equals(more.kept)


def test_the_base_policy_is_trained_on_one_thread(worked: Worked, monkeypatch: pytest.MonkeyPatch) -> None:
    """On two, sums were now and then added in another order, and the same command kept others."""
    threads, seen = torch.get_num_threads(), []
    monkeypatch.setattr(cupid_rollouts, "train", lambda *_: seen.append(torch.get_num_threads()) or [None])
    try:
        torch.set_num_threads(2)
        cupid_rollouts.base_policy(worked.problem, worked.data, LEARNING.training)
        assert seen == [1]
        assert torch.get_num_threads() == 2
    finally:
        torch.set_num_threads(threads)
