"""Intervals and tests of the result tables, by statsmodels and scipy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats
from statsmodels.stats.proportion import proportion_confint, proportions_ztest

CONFIDENCE = 0.95


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


def mean_interval(values: Sequence[float], confidence: float = CONFIDENCE) -> Interval:
    """Student's t interval of a mean; unbounded for a single value, ValueError for none."""
    mean = float(np.mean(values)) if len(values) else math.nan
    if math.isnan(mean):
        raise ValueError("an interval of a mean needs at least one value, none of them NaN")
    if len(values) == 1:
        return Interval(-math.inf, math.inf)
    half = stats.t.ppf((1 + confidence) / 2, len(values) - 1) * stats.sem(values)
    return Interval(mean - float(half), mean + float(half))
