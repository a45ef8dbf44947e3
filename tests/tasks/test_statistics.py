from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from plancurate.tasks.statistics import mean_interval, two_proportion_test, wilson_interval

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
