from __future__ import annotations

import numpy as np
import pytest
from scipy.special import digamma
from sklearn.feature_selection import mutual_info_regression

from plancurate.tasks.curation.selectors.deminf import DemInfSettings, chunks, of_steps
from plancurate.tasks.curation.selectors.mutual_information import contributions
from plancurate.tasks.curation.selectors.transitions import Transitions

from .defects import Bed, auroc, chosen, defective_pool


@pytest.fixture(scope="module")
def bed() -> Bed:
    return defective_pool(seed=1, targets=4, per_target=40)


@pytest.fixture(scope="module")
def badness(bed: Bed) -> np.ndarray:
    """The less a candidate's steps add, the worse it is; in the order of the pool."""
    kept = chosen(bed, "DemInf", budget=40)
    by_id = dict(zip(kept.ids, kept.kept["score"].to_pylist(), strict=True))
    return np.array([-by_id[one] for one in bed.pool.candidates["trajectory_id"].to_pylist()])


def estimate(x: np.ndarray, y: np.ndarray, k: int) -> float:
    """The whole of the estimator, with the constants that a ranking does without; in nats."""
    terms = contributions(x.astype(np.float32), y.astype(np.float32), [k])
    return float(terms.mean() + digamma(k) + digamma(len(x)))


@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.9])
def test_the_estimate_is_that_of_scikit_learn_and_near_the_truth(correlation: float) -> None:
    rng = np.random.default_rng(0)
    x = rng.normal(size=(2000, 1))
    y = correlation * x + np.sqrt(1 - correlation**2) * rng.normal(size=(2000, 1))
    scaled_x, scaled_y = x / x.std(), y / y.std()
    found = estimate(scaled_x, scaled_y, 5)
    assert found == pytest.approx(-0.5 * np.log(1 - correlation**2), abs=0.06)
    theirs = mutual_info_regression(scaled_x, scaled_y[:, 0], n_neighbors=5, random_state=0)[0]
    assert max(found, 0.0) == pytest.approx(theirs, abs=0.02)


def test_several_numbers_of_neighbours_are_averaged_over_and_copies_do_no_harm() -> None:
    rng = np.random.default_rng(0)
    x, y = (rng.normal(size=(60, 3)).astype(np.float32) for _ in range(2))
    each = [contributions(x, y, [k]) for k in (5, 6, 7)]
    np.testing.assert_allclose(contributions(x, y, (5, 6, 7)), np.mean(each, axis=0), rtol=1e-6)
    x[:10], y[:10] = x[0], y[0]
    found = contributions(x, y, (5,))
    # Ten pairs that are one: with the fifth neighbour at distance 0, ten are there in either half.
    np.testing.assert_allclose(found[:10], -2 * digamma(10))


def test_steps_that_follow_from_their_state_add_more_than_those_that_do_not() -> None:
    rng = np.random.default_rng(0)
    states = rng.normal(size=(3000, 2)).astype(np.float32)
    actions = states + 0.05 * rng.normal(size=(3000, 2)).astype(np.float32)
    random = rng.random(3000) < 0.2
    actions[random] = rng.normal(size=(int(random.sum()), 2))
    value = of_steps(states, actions, DemInfSettings(), rng)
    assert value[~random].mean() > value[random].mean() + 1
    assert (value.mean(), value.std()) == pytest.approx((0, 1), abs=1e-6)


def test_few_steps_tell_nothing() -> None:
    few = np.zeros((7, 2), np.float32)
    assert of_steps(few, few, DemInfSettings(), np.random.default_rng(0)).tolist() == [0.0] * 7


@pytest.mark.slow
@pytest.mark.parametrize("defect", ["detour", "reversal", "stall", "wrong_target"])
def test_candidates_with_a_defect_score_lower(bed: Bed, badness: np.ndarray, defect: str) -> None:
    assert auroc(bed, badness, defect) > 0.8


def test_a_chunk_is_the_steps_to_come_within_the_candidate() -> None:
    actions = np.arange(5, dtype=np.float32)[:, None]
    two = Transitions(actions, actions, np.array([0, 3]), np.array([3, 2]))
    assert chunks(two, 3).tolist() == [[0, 1, 2], [1, 2, 2], [2, 2, 2], [3, 4, 4], [4, 4, 4]]


@pytest.mark.slow
def test_the_native_form_keeps_its_share_of_the_pool(bed: Bed) -> None:
    n = bed.pool.candidates.num_rows
    assert len(chosen(bed, "DemInf_Native", budget=None).ids) == -(-n // 2)
    assert len(chosen(bed, "DemInf_Native", budget=None, kept_share=0.25).ids) == -(-n // 4)
