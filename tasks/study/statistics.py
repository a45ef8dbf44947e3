"""Intervals and tests of success rates, by statsmodels and scipy; those of means are in `means`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats
from statsmodels.stats.proportion import confint_proportions_2indep, proportion_confint, proportions_ztest

CONFIDENCE = 0.95


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
class Estimate:
    """A value and its standard error (above 0), taken for normal."""

    value: float
    error: float

    def interval(self, limit: float, confidence: float = CONFIDENCE) -> Interval:
        """The interval of the value, cut off at -limit and limit."""
        half = float(stats.norm.ppf((1 + confidence) / 2)) * self.error
        return Interval(max(self.value - half, -limit), min(self.value + half, limit))

    @property
    def test(self) -> Test:
        """The z-test against 0."""
        z = self.value / self.error
        return Test(z, float(2 * stats.norm.sf(abs(z))))


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


def effect_difference(gain: Estimate, published: Outcomes, published_base: Outcomes) -> Estimate:
    """Our gain over a base less the published gain over its base; above 0: ours is larger.

    The published variance is that of two independent rates, each with one success and one failure added (Agresti
    and Caffo, 2000): never 0, not even where all trials succeed.
    """
    variance = gain.error**2 + _cautious_variance(published) + _cautious_variance(published_base)
    return Estimate(gain.value - (published.rate - published_base.rate), math.sqrt(variance))


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


def _cautious_variance(outcomes: Outcomes) -> float:
    rate = (outcomes.successes + 1) / (outcomes.n + 2)
    return rate * (1 - rate) / (outcomes.n + 2)
