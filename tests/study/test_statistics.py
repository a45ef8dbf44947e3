from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from statsmodels.stats.multitest import multipletests
from statsmodels.stats.proportion import proportion_confint, proportions_ztest

from plancurate.tasks.study.means import Moments, mean_interval, moments, welch_test
from plancurate.tasks.study.statistics import (
    Estimate,
    Outcomes,
    effect_difference,
    holm,
    two_proportion_test,
    wilson_interval,
)

# Successes of 320 trials and the success rate (%) that the publication prints.
PUBLISHED = {
    "KMeans_Hybrid": (253, 79.1),
    "Hierarchical_Hybrid": (251, 78.4),
    "DBSCAN": (247, 77.2),
    "Hierarchical": (245, 76.6),
    "DBSCAN_Hybrid": (245, 76.6),
    "KMeans": (238, 74.4),
    "SCIZOR": (181, 56.6),
    "General": (173, 54.1),
    "RuleBased_General": (128, 40.0),
    "BehaviorRetrieval": (118, 36.9),
    "CUPID": (14, 4.4),
}


COUNTS = st.integers(1, 400).flatmap(
    lambda n: st.integers(0, n).map(lambda successes: Outcomes(successes, n))
)
VALUES = st.lists(st.floats(-1e3, 1e3, allow_subnormal=False), min_size=2, max_size=30)


def by_hand(successes: int, n: int) -> tuple[float, float]:
    """Wilson's interval from its formula."""
    z, p = 1.959963984540054, successes / n
    middle = (p + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z / (1 + z**2 / n) * math.sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
    return middle - half, middle + half


@pytest.mark.parametrize(("successes", "percent"), PUBLISHED.values(), ids=PUBLISHED)
def test_published_counts_give_the_published_rates_inside_wilson_intervals(
    successes: int, percent: float
) -> None:
    assert round(successes / 3.2 + 1e-9, 1) == percent
    interval = wilson_interval(successes, 320)
    assert (interval.low, interval.high) == pytest.approx(by_hand(successes, 320), abs=1e-12)
    assert interval.low < successes / 320 < interval.high


def test_253_of_320_has_its_known_interval() -> None:
    interval = wilson_interval(253, 320)
    assert (interval.low, interval.high) == pytest.approx((0.7428, 0.8317), abs=1e-4)


@pytest.mark.parametrize(
    ("selector", "z", "stars"),
    [("KMeans_Hybrid", 6.703, "***"), ("SCIZOR", 0.636, "ns"), ("RuleBased_General", -3.564, "***")],
)
def test_z_values_against_general_match_the_pooled_formula(selector: str, z: float, stars: str) -> None:
    successes, base = PUBLISHED[selector][0], PUBLISHED["General"][0]
    pooled = (successes + base) / 640
    expected = (successes - base) / 320 / math.sqrt(pooled * (1 - pooled) * 2 / 320)
    test = two_proportion_test(Outcomes(successes, 320), Outcomes(base, 320))
    assert test.statistic == pytest.approx(expected, abs=1e-12)
    assert test.statistic == pytest.approx(z, abs=2e-3)
    assert test.p == pytest.approx(2 * stats.norm.sf(abs(expected)), rel=1e-9)
    assert test.stars == stars


@given(st.integers(1, 400), st.data())
def test_wilson_intervals_stay_inside_zero_and_one(n: int, data: st.DataObject) -> None:
    successes = data.draw(st.integers(0, n))
    interval = wilson_interval(successes, n)
    assert 0 <= interval.low <= successes / n <= interval.high <= 1
    assert (interval.low, interval.high) == pytest.approx(
        proportion_confint(successes, n, method="wilson"), abs=1e-12
    )


@given(COUNTS, COUNTS)
def test_the_z_test_is_statsmodels(a: Outcomes, b: Outcomes) -> None:
    found = two_proportion_test(a, b)
    if a.rate == b.rate:
        assert (found.statistic, found.p) == (0.0, 1.0)
    else:
        z, p = proportions_ztest([a.successes, b.successes], [a.n, b.n])
        assert (found.statistic, found.p) == pytest.approx((z, p), rel=1e-9, abs=1e-300)


@pytest.mark.parametrize(("successes", "base"), [(0, 0), (20, 20), (7, 7)])
def test_equal_rates_do_not_differ_even_when_all_or_none_succeed(successes: int, base: int) -> None:
    test = two_proportion_test(Outcomes(successes, 20), Outcomes(base, 20))
    assert (test.statistic, test.p, test.stars) == (0.0, 1.0, "ns")


def test_mean_interval_is_scipys() -> None:
    values = np.random.default_rng(0).normal(3, 2, 18)
    interval = mean_interval(values.tolist())
    low, high = stats.t.interval(0.95, 17, loc=values.mean(), scale=stats.sem(values))
    assert (interval.low, interval.high) == pytest.approx((low, high), abs=1e-12)


def test_mean_interval_of_one_value_says_nothing_and_of_none_is_an_error() -> None:
    assert mean_interval([1.0]).high == math.inf
    with pytest.raises(ValueError, match="at least one value"):
        mean_interval([])
    with pytest.raises(ValueError, match="at least one trial"):
        wilson_interval(0, 0)


def test_outcomes_are_a_share_of_their_trials() -> None:
    assert Outcomes(3, 4).rate == 0.75
    with pytest.raises(ValueError, match="5 successes of 4 trials"):
        Outcomes(5, 4)
    with pytest.raises(ValueError, match="at least one trial"):
        _ = Outcomes(0, 0).rate


@given(VALUES)
def test_means_and_their_intervals_are_the_same_from_values_and_from_their_moments(
    values: list[float],
) -> None:
    found = moments(values)
    assert found.mean == pytest.approx(np.mean(values), abs=1e-12)
    assert found.std == pytest.approx(np.std(values, ddof=1), abs=1e-12)
    assert mean_interval(values) == mean_interval(found)


@given(VALUES, VALUES)
def test_welch_is_scipys_and_changes_sign_with_the_order(a: list[float], b: list[float]) -> None:
    test, turned = welch_test(a, b), welch_test(moments(b), moments(a))
    assert (turned.statistic, turned.p) == pytest.approx((-test.statistic, test.p))
    if min(np.std(a), np.std(b)) > 1e-6 and not math.isclose(np.mean(a), np.mean(b), rel_tol=1e-9):
        expected = stats.ttest_ind(a, b, equal_var=False)
        assert (test.statistic, test.p) == pytest.approx((expected.statistic, expected.pvalue), rel=1e-6)


def test_welch_by_hand() -> None:
    test = welch_test([1.0, 2.0, 3.0], [4.0, 8.0])  # means 2 and 6, variances of the means 1/3 and 4
    t = -4 / math.sqrt(13 / 3)
    freedom = (13 / 3) ** 2 / ((1 / 3) ** 2 / 2 + 4**2 / 1)
    assert (test.statistic, test.p) == pytest.approx((t, 2 * stats.t.sf(-t, freedom)))


def test_welch_without_spread_knows_equal_from_different_and_one_value_says_nothing() -> None:
    assert welch_test([0.1, 0.1, 0.1], [0.1] * 7).p == 1.0
    certain = welch_test([2.0, 2.0], [1.0, 1.0, 1.0])
    assert (certain.statistic, certain.p, certain.stars) == (math.inf, 0.0, "***")
    assert welch_test([5.0], [1.0, 1.1, 0.9]).stars == "ns"
    assert moments([5.0]) == Moments(5.0, None, 1)


@pytest.mark.slow
def test_holm_is_statsmodels() -> None:
    p = np.random.default_rng(0).beta(0.3, 1, 40).round(2)  # some are equal
    assert holm(p.tolist()) == pytest.approx(multipletests(p, method="holm")[1], abs=1e-15)


def test_holm_by_hand() -> None:
    # Sorted 0.01, 0.02, 0.03, 0.04 times 4, 3, 2, 1; an adjusted value is never below the one before.
    assert holm([0.04, 0.01, 0.03, 0.02]) == pytest.approx([0.06, 0.04, 0.06, 0.06])
    assert holm([]) == []
    assert holm([0.2]) == [0.2]
    with pytest.raises(ValueError, match="between 0 and 1"):
        holm([0.5, math.nan])


@given(st.lists(st.floats(0, 1), min_size=1, max_size=20))
def test_holm_keeps_order_and_stays_above_the_raw_values(p: list[float]) -> None:
    adjusted = holm(p)
    assert all(raw - 1e-12 <= value <= 1 for raw, value in zip(p, adjusted, strict=True))
    assert min(adjusted) == pytest.approx(min(1.0, min(p) * len(p)))  # the smallest is Bonferroni's
    by_raw = [value for _, value in sorted(zip(p, adjusted, strict=True))]
    assert by_raw == sorted(by_raw)
    turned = holm(p[::-1])
    assert turned[::-1] == pytest.approx(adjusted)


def test_our_effect_against_the_published_one_by_hand() -> None:
    gain = Estimate(0.3, 0.1)
    found = effect_difference(gain, Outcomes(253, 320), Outcomes(173, 320))
    variances = [0.01, 254 / 322 * 68 / 322 / 322, 174 / 322 * 148 / 322 / 322]
    z = (0.3 - 0.25) / math.sqrt(sum(variances))
    half = 1.959963984540054 * math.sqrt(sum(variances))
    assert found.value == pytest.approx(0.05)
    interval = found.interval(2.0)
    assert (interval.low, interval.high) == pytest.approx((0.05 - half, 0.05 + half))
    assert (found.test.statistic, found.test.p) == pytest.approx((z, 2 * stats.norm.sf(z)))


@given(st.floats(-1, 1), st.floats(1e-3, 1), st.floats(0.5, 0.999))
def test_an_estimate_differs_from_0_exactly_where_its_interval_leaves_out_0(
    value: float, error: float, confidence: float
) -> None:
    found = Estimate(value, error)
    interval = found.interval(1.0, confidence)
    assert -1 <= interval.low <= value <= interval.high <= 1
    outside = not interval.low <= 0 <= interval.high
    assert outside == (found.test.p < 1 - confidence) or found.test.p == pytest.approx(1 - confidence)
    assert Estimate(-value, error).test.statistic == -found.test.statistic
