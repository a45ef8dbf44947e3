from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
import torch
from torch.nn.functional import binary_cross_entropy

from plancurate.tasks.curation.selectors import demo_score
from plancurate.tasks.curation.selectors.base import Problem
from plancurate.tasks.curation.selectors.demo_score import best_classifier, labelled
from plancurate.tasks.curation.selectors.sampled_policy import Rollouts, Steps
from plancurate.tasks.curation.selectors.success_classifier import Labelled, fit, held_loss
from plancurate.tasks.curation.selectors.transitions import load_transitions, standardised

from .defects import Bed, auroc, chosen, defective_pool

pytestmark = pytest.mark.training
QUICK = {"steps": 400, "rollouts": 8, "classifier_steps": 400, "policies": 2}


@pytest.fixture(scope="module")
def bed() -> Bed:
    return defective_pool(seed=3, targets=4, per_target=30)


def cloud(rng: np.random.Generator, share: float, n: int = 2000) -> Labelled:
    """States of which the first number decides the outcome, in most cases."""
    success = (rng.random(n) < share).astype(np.float32)
    states = rng.normal(size=(n, 3)).astype(np.float32)
    states[:, 0] += 2 * success - 1
    return Labelled(states, success)


def test_a_classifier_learns_what_tells_success_from_failure() -> None:
    rng = np.random.default_rng(0)
    found = fit(cloud(rng, 0.3), [cloud(rng, 0.6)], 1500, torch.Generator().manual_seed(0))
    new = cloud(rng, 0.5)
    assert np.mean((found.probability(new.states) > 0.5) == (new.success > 0)) > 0.8


def test_the_loss_on_held_rollouts_weighs_both_outcomes_alike() -> None:
    held = cloud(np.random.default_rng(0), 0.1)
    network = fit(held, [held], 5, torch.Generator().manual_seed(0)).network
    p = torch.sigmoid(network(torch.from_numpy(held.states))[:, 0]).detach()
    truth = torch.from_numpy(held.success)
    each = [float(binary_cross_entropy(p[truth == side], truth[truth == side])) for side in (0, 1)]
    assert held_loss(network, held) == pytest.approx(np.mean(each), rel=1e-4)


def test_the_classifier_that_does_best_on_the_others_rollouts_is_chosen() -> None:
    rng = np.random.default_rng(0)
    good, also_good, misleading = cloud(rng, 0.5), cloud(rng, 0.5), cloud(rng, 0.5)
    wrong = Labelled(misleading.states, 1 - misleading.success)
    found = best_classifier([wrong, good, also_good], 800, seed=0)
    assert found.probability(np.array([[3, 0, 0]], np.float32)) > 0.5


def test_every_state_of_a_rollout_has_the_rollouts_outcome() -> None:
    states = np.zeros((5, 2), np.float32)
    steps = Steps(states, states, np.array([0, 2]), np.array([2, 3]))
    found = labelled(Rollouts(steps, np.array([1.0, -1.0]), np.zeros(2, np.int64)))
    assert found.success.tolist() == [1, 1, 0, 0, 0]
    assert not found.one_sided


def test_candidates_that_look_like_failures_score_lower(bed: Bed, monkeypatch: pytest.MonkeyPatch) -> None:
    def rolled_out(problem: Problem, *_: object) -> Iterator[tuple[Steps, Rollouts]]:
        """As if policies had done what the candidates do, and failed where these lead elsewhere."""
        found = load_transitions(problem)
        steps = Steps(standardised(found.observations), found.actions, found.starts, found.lengths)
        rollouts = Rollouts(steps, np.where(bed.label == "wrong_target", -1.0, 1.0), found.starts)
        return iter([(steps, rollouts), (steps, rollouts)])

    monkeypatch.setattr(demo_score, "policies_rollouts", rolled_out)
    kept = chosen(bed, "DemoSCORE", 30, classifier_steps=1500)
    by_id = dict(zip(kept.ids, kept.kept["score"].to_pylist(), strict=True))
    badness = np.array([-by_id[one] for one in bed.pool.candidates["trajectory_id"].to_pylist()])
    assert auroc(bed, badness, "wrong_target") > 0.8


def test_the_native_form_keeps_what_is_above_the_rollouts_mean(bed: Bed) -> None:
    kept = chosen(bed, "DemoSCORE_Native", None, **QUICK)
    assert 0 < len(kept.ids) < bed.pool.candidates.num_rows
    scores, ranks = kept.kept["score"].to_numpy(), kept.kept["rank"].to_numpy()
    assert scores[ranks.argmin()] == scores.max()


def test_rollouts_that_all_end_alike_tell_nothing(bed: Bed) -> None:
    kept = chosen(bed, "DemoSCORE", 2, **{**QUICK, "steps": 1})
    assert set(kept.kept["score"].to_pylist()) == {0.5}
