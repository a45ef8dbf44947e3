"""Values as a reader wants them in a table."""

from __future__ import annotations

import math

from plancurate.tasks.report.rows import Comparison, Mean
from plancurate.tasks.study.statistics import Interval

NOTHING = "\N{EN DASH}"


def percent(share: float | None) -> str:
    """A share of 1 in percent."""
    return NOTHING if share is None else f"{100 * share:.1f}"


def percents(interval: Interval | None) -> str:
    """An interval of shares in percent."""
    return NOTHING if interval is None else f"[{100 * interval.low:.1f}, {100 * interval.high:.1f}]"


def points(share: float) -> str:
    """A difference of shares in percentage points, with its sign."""
    return f"{100 * share:+.1f}"


def decimals(value: float | None) -> str:
    """A measured value: three decimals while it is small, fewer later."""
    if value is None or math.isinf(value):
        return NOTHING
    return f"{value:.3f}" if abs(value) < 10 else f"{value:.2f}" if abs(value) < 1000 else f"{value:.0f}"


def seconds(value: float | None) -> str:
    """A time in s, to three significant digits."""
    if value is None:
        return NOTHING
    if 0 < value < 0.001:
        return "< 0.001"
    return f"{value:.3g}" if value < 1000 else f"{value:.0f}"


def probability(p: float) -> str:
    """A p value."""
    return "< 0.001" if p < 0.001 else f"{p:.3f}"


def stars(comparison: Comparison | None) -> str:
    """Stars of a test; nothing for the baseline itself."""
    return "" if comparison is None else comparison.stars


def mean(value: Mean) -> str:
    """A mean, its interval and stars."""
    spread = ""
    if math.isfinite(value.interval.low):
        spread = f"[{decimals(value.interval.low)}, {decimals(value.interval.high)}]"
    return " ".join(part for part in (decimals(value.value), spread, stars(value.against_general)) if part)


def with_published(ours: str, published: str) -> str:
    """Our value, the publication's in parentheses where there is one."""
    return ours if published == NOTHING else f"{ours} ({published})"


def budget(number: int | None) -> str:
    """A budget; all where the selector has none."""
    return "all" if number is None else str(number)
