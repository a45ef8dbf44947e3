"""Intervals and tests of the result tables, by statsmodels and scipy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats
from statsmodels.stats.proportion import confint_proportions_2indep, proportion_confint, proportions_ztest

CONFIDENCE = 0.95
DRAWS = 10_000
# Means that agree to this share are the same number summed in another order.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class Outcomes:
    """Successes of n trials."""

    successes: int
    n: int

    def __post_init__(self) -> None:
        if not 0 <= self.successes <= self.n:
            raise ValueError(f"{self.successes} successes of {self.n} trials")

    @property
    def rate(self) -> float:
        """Share of successes, 0 to 1; ValueError without trials."""
        if not self.n:
            raise ValueError("a rate needs at least one trial")
        return self.successes / self.n


@dataclass(frozen=True)
class Moments:
    """Mean and sample standard deviation (n - 1) of n values; the deviation of a single value is None."""

    mean: float
    std: float | None
    n: int


@dataclass(frozen=True)
class Interval:
    """A confidence interval."""

    low: float
    high: float


@dataclass(frozen=True)
class Test:
    """A two-sided test: the statistic (z or t) and its p value."""

    statistic: float
    p: float

    @property
    def stars(self) -> str:
        """*** for p < 0.001, ** for p < 0.01, * for p < 0.05, ns otherwise."""
        return next((sign for sign, limit in _STARS if self.p < limit), "ns")


_STARS = (("***", 0.001), ("**", 0.01), ("*", 0.05))


@dataclass(frozen=True)
class Difference:
    """A difference of rates (1 is 100 percentage points) with its interval and the test against 0."""

    value: float
    interval: Interval
    test: Test


def wilson_interval(successes: int, n: int, confidence: float = CONFIDENCE) -> Interval:
    """Wilson's interval of a success rate; ValueError without trials."""
    if n < 1:
        raise ValueError("an interval needs at least one trial")
    low, high = proportion_confint(successes, n, alpha=1 - confidence, method="wilson")
    return Interval(float(low), float(high))


def two_proportion_test(successes: int, n: int, base_successes: int, base_n: int) -> Test:
    """z-test (pooled variance) of a success rate against a base rate; z > 0: higher than the base."""
    if successes * base_n == base_successes * n:  # equal rates; with all or none successful, z would be 0/0
        return Test(0.0, 1.0)
    z, p = proportions_ztest([successes, base_successes], [n, base_n])
    return Test(float(z), float(p))


def rate_difference(outcomes: Outcomes, base: Outcomes, confidence: float = CONFIDENCE) -> Difference:
    """Success rate less a base rate: Newcombe's hybrid score interval (1998), pooled z-test."""
    low, high = confint_proportions_2indep(
        outcomes.successes, outcomes.n, base.successes, base.n, method="newcomb", alpha=1 - confidence
    )
    test = two_proportion_test(outcomes.successes, outcomes.n, base.successes, base.n)
    return Difference(outcomes.rate - base.rate, Interval(float(low), float(high)), test)


def effect_difference(
    outcomes: Outcomes,
    base: Outcomes,
    published: Outcomes,
    published_base: Outcomes,
    confidence: float = CONFIDENCE,
) -> Difference:
    """Our gain over the base less the published gain over its base; z > 0: ours is larger.

    The four rates are independent, so the variance is the sum of theirs. Each is that of a rate with one
    success and one failure added (Agresti and Caffo, 2000): never 0, not even where all trials succeed.
    """
    rates = (outcomes, base, published, published_base)
    value = (outcomes.rate - base.rate) - (published.rate - published_base.rate)
    error = math.sqrt(sum(_cautious_variance(rate) for rate in rates))
    half = float(stats.norm.ppf((1 + confidence) / 2)) * error
    test = Test(value / error, float(2 * stats.norm.sf(abs(value) / error)))
    return Difference(value, Interval(max(value - half, -2.0), min(value + half, 2.0)), test)


def holm(p_values: Sequence[float]) -> list[float]:
    """Holm-adjusted p values of one family of tests, in the order given; ValueError outside [0, 1]."""
    if not all(0 <= p <= 1 for p in p_values):
        raise ValueError("p values lie between 0 and 1")
    # statsmodels' multipletests gives the same, but collects garbage at every call: tenths of a second.
    p = np.asarray(p_values, dtype=np.float64)
    order = np.argsort(p, kind="stable")
    adjusted = np.empty_like(p)
    adjusted[order] = np.minimum(np.maximum.accumulate(p[order] * np.arange(len(p), 0, -1)), 1.0)
    return [float(value) for value in adjusted]


def cluster_bootstrap_interval(
    clusters: Sequence[Outcomes],
    strata: Sequence[str] | None = None,
    confidence: float = CONFIDENCE,
    seed: int = 0,
    draws: int = DRAWS,
) -> Interval:
    """Percentile interval of the pooled success rate when whole clusters of trials are drawn again.

    A cluster is what varies as one: the trials of one trained network. `strata` names the fixed group of
    each cluster, such as its policy; clusters are then drawn within their group. Clusters of equal rates
    give an interval without width; with few clusters it is too narrow (Wilson's belongs beside it).
    A group of a single cluster shows no spread, so that every rate stays possible: [0, 1].
    ValueError without clusters or for one without trials.
    """
    if not clusters or not all(cluster.n for cluster in clusters):
        raise ValueError("a bootstrap needs at least one cluster, and trials in each")
    groups = _grouped(clusters, strata if strata is not None else [""] * len(clusters))
    if any(len(group) == 1 for group in groups):
        return Interval(0.0, 1.0)
    rng = np.random.default_rng(seed)
    totals = np.zeros((draws, 2), dtype=np.int64)  # successes and trials of each draw
    for group in groups:
        times_drawn = rng.multinomial(len(group), np.full(len(group), 1 / len(group)), size=draws)
        totals += times_drawn @ group
    rates = totals[:, 0] / totals[:, 1]
    low, high = np.quantile(rates, [(1 - confidence) / 2, (1 + confidence) / 2])
    return Interval(float(low), float(high))


def moments(values: Sequence[float]) -> Moments:
    """Mean and sample standard deviation of values; ValueError for none or NaN among them."""
    mean = float(np.mean(values)) if len(values) else math.nan
    if math.isnan(mean):
        raise ValueError("a mean needs at least one value, none of them NaN")
    return Moments(mean, float(np.std(values, ddof=1)) if len(values) > 1 else None, len(values))


def mean_interval(values: Sequence[float] | Moments, confidence: float = CONFIDENCE) -> Interval:
    """Student's t interval of a mean; unbounded for a single value, ValueError for none."""
    found = values if isinstance(values, Moments) else moments(values)
    if found.std is None:
        return Interval(-math.inf, math.inf)
    half = float(stats.t.ppf((1 + confidence) / 2, found.n - 1)) * found.std / math.sqrt(found.n)
    return Interval(found.mean - half, found.mean + half)


def welch_test(values: Sequence[float] | Moments, base: Sequence[float] | Moments) -> Test:
    """Welch's t-test (unequal variances) of a mean against a base mean; t > 0: larger than the base.

    A single value has no spread to judge a difference by: t = 0, p = 1. Means that differ between values
    without spread differ for certain: t infinite, p = 0.
    """
    a, b = (v if isinstance(v, Moments) else moments(v) for v in (values, base))
    if a.std is None or b.std is None or math.isclose(a.mean, b.mean, rel_tol=_ROUNDING, abs_tol=1e-15):
        return Test(0.0, 1.0)
    t, p = stats.ttest_ind_from_stats(a.mean, a.std, a.n, b.mean, b.std, b.n, equal_var=False)
    return Test(float(t), float(p))


def _cautious_variance(outcomes: Outcomes) -> float:
    rate = (outcomes.successes + 1) / (outcomes.n + 2)
    return rate * (1 - rate) / (outcomes.n + 2)


def _grouped(clusters: Sequence[Outcomes], strata: Sequence[str]) -> list[np.ndarray]:
    """Successes and trials of the clusters of each stratum: one (clusters,2) array a stratum."""
    groups: dict[str, list[tuple[int, int]]] = {}
    for cluster, stratum in zip(clusters, strata, strict=True):
        groups.setdefault(stratum, []).append((cluster.successes, cluster.n))
    return [np.array(group, dtype=np.int64) for group in groups.values()]
