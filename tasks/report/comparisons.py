"""Tests of a table's rows against General's, as one family for Holm's adjustment."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from plancurate.tasks.report.published import PublishedResult, published_results
from plancurate.tasks.report.rows import Comparison
from plancurate.tasks.report.source import is_base
from plancurate.tasks.study.statistics import Outcomes, Test, holm, two_proportion_test

Row = Mapping[str, Any]


def against_general(
    rows: Sequence[Row], test: Callable[[Row, Row], Test], group: str | None = None
) -> list[Comparison | None]:
    """Test every row against General's of the same `group` (a column); None for General and without one."""
    bases = {row[group] if group else None: row for row in rows if is_base(row)}
    tests: list[Test | None] = []
    for row in rows:
        base = bases.get(row[group] if group else None)
        tests.append(None if base is None or is_base(row) else test(row, base))
    adjusted = iter(holm([found.p for found in tests if found]))
    return [
        None if found is None else Comparison(found.statistic, found.p, next(adjusted), found.stars)
        for found in tests
    ]


def by_successes(row: Row, base: Row) -> Test:
    """The z-test of two success rates."""
    return two_proportion_test(row["successes"], row["n"], base["successes"], base["n"])


def outcomes(row: Row) -> Outcomes:
    """Successes and trials of a row."""
    return Outcomes(row["successes"], row["n"])


def published(row: Row) -> PublishedResult | None:
    """What the publication has on the row's selector."""
    return published_results().get(row["selector"])


def published_rate(row: Row, part: Callable[[PublishedResult], Outcomes | None]) -> float | None:
    """A part of the row's published successes as a rate, where there is one."""
    known = published(row)
    found = None if known is None else part(known)
    return None if found is None else found.rate
