"""Values as a reader wants them in a table: on the terminal, in Markdown and on the page."""

from __future__ import annotations

import math

from plancurate.tasks.study.rows import ALL_SCENES, Mean, PlainTest, Row
from plancurate.tasks.study.selection_rows import PoolRow, RankingRow
from plancurate.tasks.study.statistics import Interval

NOTHING = "\N{EN DASH}"


def budget(number: int | None) -> str:
    """A budget; all where the selector has none."""
    return "all" if number is None else str(number)


def percent(share: float | None) -> str:
    """A share of 1 in percent."""
    return NOTHING if share is None else f"{100 * share:.1f}"


def percents(interval: Interval | None) -> str:
    """An interval of shares in percent."""
    return NOTHING if interval is None else f"[{100 * interval.low:.1f}, {100 * interval.high:.1f}]"


def whole_percents(interval: Interval) -> str:
    """An interval of shares in whole percent, where room is short."""
    return f"[{100 * interval.low:.0f},{100 * interval.high:.0f}]"


def points(share: float) -> str:
    """A difference of shares in percentage points, with its sign."""
    return f"{100 * share:+.1f}"


def distance(share: float) -> str:
    """How far above or below something lies, in percentage points."""
    return f"{100 * abs(share):.1f} points {'above' if share >= 0 else 'below'}"


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


def seconds_interval(interval: Interval | None) -> str:
    """An interval of times in s; none of them is below 0."""
    return NOTHING if interval is None else f"[{seconds(max(interval.low, 0.0))}, {seconds(interval.high)}]"


def probability(p: float) -> str:
    """A p value."""
    return "< 0.001" if p < 0.001 else f"{p:.3f}"


def p_value(p: float) -> str:
    """A p value in a sentence."""
    return "p < 0.001" if p < 0.001 else f"p = {probability(p)}"


def mean(value: Mean) -> str:
    """A mean, its interval and the stars of the publication's test."""
    spread = ""
    if math.isfinite(value.interval.low):
        spread = f"[{decimals(value.interval.low)}, {decimals(value.interval.high)}]"
    return " ".join(part for part in (decimals(value.value), spread, plain_stars(value.welch_test)) if part)


def plain_stars(test: PlainTest | None) -> str:
    """Stars of a test; nothing where there is none."""
    return "" if test is None else test.stars


def with_published(ours: str, published: float | None) -> str:
    """Our value, the publication's rate in parentheses where there is one."""
    return ours if published is None else f"{ours} ({percent(published)})"


def pool(row: PoolRow) -> str:
    """What the candidates of a pool are worth."""
    counts = (
        f"{row.candidates} candidates to {row.targets} targets, {row.distinct} distinct "
        f"({percent(row.distinct_share)} %, {row.distinct_a_target:.1f} a target)"
    )
    if row.goal_classes and row.ways:
        counts += f", {row.goal_classes:.1f} goal configurations and {row.ways:.1f} ways a target"
    return counts + ("; degenerate: selections from it can hardly differ" if row.degenerate else "")


def degenerate(row: PoolRow) -> str:
    """What to know of a degenerate pool beside results from it."""
    return (
        f"The pool of {group(row)} is degenerate: only {row.distinct} of its {row.candidates} candidates differ, "
        "so that selections can hardly differ."
    )


def unsteady(row: RankingRow) -> str:
    """What to know of a selection whose scores rank little better than chance."""
    return (
        f"{row.name} in {group(row)}: two halves of its rollouts rank candidates with a correlation of "
        f"{row.split_half:.2f} only, so that other rollouts would keep others; its parameter rollouts can be raised."
    )


def group(row: Row | PoolRow) -> str:
    """A scene, with the variant of its candidates where there are several."""
    scene = row.scene if row.scene == ALL_SCENES else f"scene {row.scene}"
    return f"{scene}, {row.pool_label}" if row.pool_label else scene
