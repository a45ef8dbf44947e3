"""Intervals and tests of means: Student's and Welch's, by scipy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from plancurate.tasks.study.statistics import CONFIDENCE, Interval, Test

# Means that agree to this share are the same number summed in another order.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class Moments:
    """Mean and sample standard deviation (n - 1) of n values; the deviation of a single value is None."""

    mean: float
    std: float | None
    n: int


def moments(values: Sequence[float]) -> Moments:
    """Mean and sample standard deviation of values; ValueError for none or NaN among them."""
    mean = float(np.mean(values)) if len(values) else math.nan
    if math.isnan(mean):
        raise ValueError("a mean needs at least one value, none of them NaN")
    return Moments(mean, float(np.std(values, ddof=1)) if len(values) > 1 else None, len(values))


def mean_interval(values: Sequence[float] | Moments, confidence: float = CONFIDENCE) -> Interval:
    """Student's t interval of a mean; unbounded for a single value, ValueError for none."""
    from scipy import stats  # most of a second, which no --help needs

    given = values if isinstance(values, Moments) else moments(values)
    if given.std is None:
        return Interval(-math.inf, math.inf)
    half = float(stats.t.ppf((1 + confidence) / 2, given.n - 1)) * given.std / math.sqrt(given.n)
    return Interval(given.mean - half, given.mean + half)


def welch_test(values: Sequence[float] | Moments, base: Sequence[float] | Moments) -> Test:
    """Welch's t-test (unequal variances) of a mean against a base mean; t > 0: larger than the base.

    A single value has no spread to judge a difference by: t = 0, p = 1. Means that differ between values
    without spread differ for certain: t infinite, p = 0.
    """
    from scipy import stats  # most of a second, which no --help needs

    a, b = (v if isinstance(v, Moments) else moments(v) for v in (values, base))
    if a.std is None or b.std is None or math.isclose(a.mean, b.mean, rel_tol=_ROUNDING, abs_tol=1e-15):
        return Test(0.0, 1.0)
    t, p = stats.ttest_ind_from_stats(a.mean, a.std, a.n, b.mean, b.std, b.n, equal_var=False)
    return Test(float(t), float(p))
