from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from statsmodels.stats.multitest import multipletests

from plancurate.tasks.study.statistics import (
    Interval,
    Moments,
    Outcomes,
    cluster_bootstrap_interval,
    effect_difference,
    holm,
    mean_interval,
    moments,
    rate_difference,
    two_proportion_test,
    welch_test,
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
    test = two_proportion_test(successes, 320, base, 320)
    assert test.statistic == pytest.approx(expected, abs=1e-12)
    assert test.statistic == pytest.approx(z, abs=2e-3)
    assert test.p == pytest.approx(2 * stats.norm.sf(abs(expected)), rel=1e-9)
    assert test.stars == stars


@given(st.integers(1, 400), st.data())
def test_wilson_intervals_stay_inside_zero_and_one(n: int, data: st.DataObject) -> None:
    successes = data.draw(st.integers(0, n))
    interval = wilson_interval(successes, n)
    assert 0 <= interval.low <= successes / n <= interval.high <= 1 or (successes in (0, n))
    assert -1e-12 <= interval.low <= interval.high <= 1 + 1e-12


@pytest.mark.parametrize(("successes", "base"), [(0, 0), (20, 20), (7, 7)])
def test_equal_rates_do_not_differ_even_when_all_or_none_succeed(successes: int, base: int) -> None:
    test = two_proportion_test(successes, 20, base, 20)
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


@given(COUNTS, COUNTS)
def test_a_difference_of_rates_lies_in_its_interval_and_changes_sign_with_the_order(
    a: Outcomes, b: Outcomes
) -> None:
    found, turned = rate_difference(a, b), rate_difference(b, a)
    assert -1 - 1e-9 <= found.interval.low <= found.value + 1e-9
    assert found.value - 1e-9 <= found.interval.high <= 1 + 1e-9
    assert (turned.interval.low, turned.interval.high) == pytest.approx(
        (-found.interval.high, -found.interval.low), abs=1e-9
    )
    assert found.test == two_proportion_test(a.successes, a.n, b.successes, b.n)


def test_newcombes_own_example_has_its_printed_interval() -> None:
    found = rate_difference(Outcomes(56, 70), Outcomes(48, 80))  # Newcombe 1998, table II, example a
    assert (found.interval.low, found.interval.high) == pytest.approx((0.0524, 0.3339), abs=5e-5)


def test_our_effect_against_the_published_one_by_hand() -> None:
    found = effect_difference(Outcomes(18, 20), Outcomes(12, 20), Outcomes(253, 320), Outcomes(173, 320))
    variances = [19 / 22 * 3 / 22 / 22, 13 / 22 * 9 / 22 / 22]
    variances += [254 / 322 * 68 / 322 / 322, 174 / 322 * 148 / 322 / 322]
    z = (0.3 - 0.25) / math.sqrt(sum(variances))
    half = 1.959963984540054 * math.sqrt(sum(variances))
    assert found.value == pytest.approx(0.05)
    assert (found.interval.low, found.interval.high) == pytest.approx((0.05 - half, 0.05 + half))
    assert (found.test.statistic, found.test.p) == pytest.approx((z, 2 * stats.norm.sf(z)))


@given(COUNTS, COUNTS, COUNTS, COUNTS)
def test_an_effect_differs_significantly_exactly_where_its_interval_leaves_out_zero(
    a: Outcomes, b: Outcomes, c: Outcomes, d: Outcomes
) -> None:
    found = effect_difference(a, b, c, d)
    assert -2 <= found.interval.low <= found.value <= found.interval.high <= 2
    outside = not found.interval.low <= 0 <= found.interval.high
    assert outside == (found.test.p < 0.05) or found.test.p == pytest.approx(0.05)
    assert effect_difference(a, b, a, b).value == 0
    assert effect_difference(c, d, a, b).test.statistic == pytest.approx(-found.test.statistic)


@given(st.lists(COUNTS, min_size=2, max_size=8), st.integers(0, 5))
def test_a_bootstrap_interval_repeats_by_seed_and_lies_between_the_clusters_rates(
    clusters: list[Outcomes], seed: int
) -> None:
    interval = cluster_bootstrap_interval(clusters, seed=seed, draws=200)
    assert interval == cluster_bootstrap_interval(clusters, seed=seed, draws=200)
    rates = [cluster.rate for cluster in clusters]
    assert min(rates) - 1e-12 <= interval.low <= interval.high <= max(rates) + 1e-12


def test_two_clusters_are_drawn_as_often_as_two_coins_fall() -> None:
    # Draws: twice the first (1/4), one of each (1/2), twice the second (1/4).
    clusters = [Outcomes(1, 10), Outcomes(7, 10)]
    assert cluster_bootstrap_interval(clusters, confidence=0.4) == Interval(0.4, 0.4)
    assert cluster_bootstrap_interval(clusters, confidence=0.6) == Interval(0.1, 0.7)


def test_a_bootstrap_of_many_single_trials_is_the_binomial_one() -> None:
    interval = cluster_bootstrap_interval([Outcomes(i % 2, 1) for i in range(400)], draws=40_000)
    low, high = stats.binom.ppf([0.025, 0.975], 400, 0.5) / 400
    assert (interval.low, interval.high) == pytest.approx((low, high), abs=0.0051)


def test_clusters_that_vary_as_one_have_a_wider_interval_than_wilsons() -> None:
    clusters = [Outcomes(successes, 80) for successes in (20, 60, 35, 70, 10, 50)]
    interval, naive = cluster_bootstrap_interval(clusters), wilson_interval(245, 480)
    assert interval.high - interval.low > 3 * (naive.high - naive.low)


def test_within_strata_only_the_clusters_of_a_stratum_stand_for_each_other() -> None:
    clusters = [Outcomes(9, 10), Outcomes(9, 10), Outcomes(1, 10), Outcomes(1, 10)]
    policies = ["BC_RNN", "BC_RNN", "BC_MLP", "BC_MLP"]
    assert cluster_bootstrap_interval(clusters, strata=policies) == Interval(0.5, 0.5)
    assert cluster_bootstrap_interval(clusters).low < 0.5


def test_a_bootstrap_without_spread_has_no_width_and_of_one_cluster_leaves_all_possible() -> None:
    assert cluster_bootstrap_interval([Outcomes(2, 6), Outcomes(1, 3)]) == Interval(1 / 3, 1 / 3)
    assert cluster_bootstrap_interval([Outcomes(2, 6)]) == Interval(0.0, 1.0)
    one_each = cluster_bootstrap_interval([Outcomes(2, 6), Outcomes(3, 6)], strata=["a", "b"])
    assert one_each == Interval(0.0, 1.0)
    for clusters in ([], [Outcomes(1, 2), Outcomes(0, 0)]):
        with pytest.raises(ValueError, match="at least one cluster"):
            cluster_bootstrap_interval(clusters)
