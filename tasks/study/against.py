"""Rows of a table against General's, each scene's rows as one family for Holm's adjustment."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Hashable, Mapping, Sequence
from typing import Any, TypeVar

from plancurate.tasks.study.bootstrap import Counts, paired_difference
from plancurate.tasks.study.means import Moments, welch_test
from plancurate.tasks.study.rows import Cell, Gain, PlainTest
from plancurate.tasks.study.statistics import Estimate, Outcomes, Test, holm, two_proportion_test

BASELINE = "General"
SURE = 0.05

SqlRow = Mapping[str, Any]
Found = TypeVar("Found")


def cell(row: SqlRow) -> Cell:
    """The selection that a row of a query is about."""
    return Cell(row["scene"], row["pool_label"], row["selector"], row["budget"])


def outcomes(row: SqlRow) -> Outcomes:
    """Successes and trials of a row."""
    return Outcomes(row["successes"], row["n"])


def against_base(
    rows: Sequence[SqlRow], compare: Callable[[SqlRow, SqlRow], Found], part: str | None = None
) -> list[Found | None]:
    """Compare each row with General's of the same scene, pool label and `part` (a column); None for General's."""

    def group(row: SqlRow) -> Hashable:
        return row["scene"], row["pool_label"], row[part] if part else None

    bases = {group(row): row for row in rows if row["selector"] == BASELINE}
    return [
        compare(row, bases[group(row)]) if group(row) in bases and row["selector"] != BASELINE else None
        for row in rows
    ]


def gains(
    rows: Sequence[SqlRow], counts: Callable[[SqlRow], Counts], part: str | None = None
) -> list[Gain | None]:
    """Success of each row less General's, from bootstrap draws; None for General and where it is missing."""

    def compare(row: SqlRow, base: SqlRow) -> tuple[float, Estimate, Test]:
        value = outcomes(row).rate - outcomes(base).rate
        z_test = two_proportion_test(outcomes(row), outcomes(base))
        return value, paired_difference(counts(row), counts(base)), z_test

    compared = against_base(rows, compare, part)
    adjusted = holm_by_scene(rows, [None if one is None else one[1].test.p for one in compared])
    return [
        None if one is None or p is None else _gain(*one, p)
        for one, p in zip(compared, adjusted, strict=True)
    ]


def welch_tests(rows: Sequence[SqlRow], measure: str) -> list[PlainTest | None]:
    """Welch's test of a measure's mean against General's, over all trials."""

    def compare(row: SqlRow, base: SqlRow) -> PlainTest:
        return plain_test(welch_test(moments_of(row, measure), moments_of(base, measure)))

    return against_base(rows, compare)


def holm_by_scene(rows: Sequence[SqlRow], p_values: Sequence[float | None]) -> list[float | None]:
    """Holm's p values, each scene and pool label a family; None stays None."""
    families: dict[Hashable, list[int]] = defaultdict(list)
    for i, (row, p) in enumerate(zip(rows, p_values, strict=True)):
        if p is not None:
            families[row["scene"], row["pool_label"]].append(i)
    adjusted: list[float | None] = [None] * len(rows)
    for members in families.values():
        for i, p in zip(members, holm([p_values[i] or 0.0 for i in members]), strict=True):
            adjusted[i] = p
    return adjusted


def ties(rows: Sequence[SqlRow], counts: Callable[[SqlRow], Counts]) -> set[Cell]:
    """The best selection of each scene and those that are not significantly below it (Holm over the scene).

    rows: best first within a scene and pool label.
    """
    first: dict[Hashable, SqlRow] = {}
    for row in rows:
        first.setdefault((row["scene"], row["pool_label"]), row)
    tops = [first[row["scene"], row["pool_label"]] for row in rows]
    p_values = [
        None if top is row else paired_difference(counts(top), counts(row)).test.p
        for row, top in zip(rows, tops, strict=True)
    ]
    adjusted = holm_by_scene(rows, p_values)
    return {cell(row) for row, p in zip(rows, adjusted, strict=True) if p is None or p >= SURE}


def moments_of(row: SqlRow, measure: str) -> Moments:
    """Mean, deviation and number of a measure."""
    return Moments(row[measure], row[f"{measure}_std"], row["n"])


def plain_test(test: Test) -> PlainTest:
    """A test as rows hold it."""
    return PlainTest(test.statistic, test.p, test.stars)


def _gain(value: float, estimate: Estimate, z_test: Test, holm_p: float) -> Gain:
    test = estimate.test
    stars = Test(test.statistic, holm_p).stars
    return Gain(value, estimate.error, estimate.interval(1.0), test.p, holm_p, stars, plain_test(z_test))
