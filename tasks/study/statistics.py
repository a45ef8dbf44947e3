"""Intervals and tests of success rates; those of means are in `means`, those over drawn seeds in `bootstrap`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

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
        half = quantile(confidence) * self.error
        return Interval(max(self.value - half, -limit), min(self.value + half, limit))

    @property
    def test(self) -> Test:
        """The z-test against 0."""
        z = self.value / self.error
        return Test(z, math.erfc(abs(z) / math.sqrt(2)))


def wilson_interval(successes: int, n: int, confidence: float = CONFIDENCE) -> Interval:
    """Wilson's interval of a success rate; ValueError without trials."""
    if n < 1:
        raise ValueError("an interval needs at least one trial")
    z, rate = quantile(confidence), successes / n
    middle = (rate + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z / (1 + z**2 / n) * math.sqrt(rate * (1 - rate) / n + z**2 / (4 * n**2))
    # At 0 and n successes an end is the rate itself, but for rounding.
    return Interval(middle - half if successes else 0.0, middle + half if successes < n else 1.0)


def two_proportion_test(outcomes: Outcomes, base: Outcomes) -> Test:
    """z-test (pooled variance) of a success rate against a base rate; z > 0: higher than the base."""
    if (
        outcomes.successes * base.n == base.successes * outcomes.n
    ):  # with all or none successful, z would be 0/0
        return Test(0.0, 1.0)
    pooled = (outcomes.successes + base.successes) / (outcomes.n + base.n)
    error = math.sqrt(pooled * (1 - pooled) * (1 / outcomes.n + 1 / base.n))
    return Estimate(outcomes.rate - base.rate, error).test


def quantile(confidence: float) -> float:
    """How many standard errors a two-sided normal interval reaches to either side."""
    return NormalDist().inv_cdf((1 + confidence) / 2)


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
    p = np.asarray(p_values, dtype=np.float64)
    order = np.argsort(p, kind="stable")
    adjusted = np.empty_like(p)
    adjusted[order] = np.minimum(np.maximum.accumulate(p[order] * np.arange(len(p), 0, -1)), 1.0)
    return [float(value) for value in adjusted]


def _cautious_variance(outcomes: Outcomes) -> float:
    rate = (outcomes.successes + 1) / (outcomes.n + 2)
    return rate * (1 - rate) / (outcomes.n + 2)
