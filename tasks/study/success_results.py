"""Success rates of a study: by selection, by policy and by distance, each against General's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from plancurate.tasks.study.against import SqlRow, cell, gains, ties
from plancurate.tasks.study.bootstrap import Counts, rate_interval
from plancurate.tasks.study.published import PublishedResult
from plancurate.tasks.study.rows import ALL_SCENES, Cell, DistanceRow, PolicyRow, SummaryRow
from plancurate.tasks.study.statistics import wilson_interval
from plancurate.tasks.study.trials import Drawn

Published = Mapping[str, PublishedResult]
"""What the publication has on each selector; nothing for tests that it did not make."""


def summary_rows(
    rows: Sequence[SqlRow],
    drawn: Mapping[Cell, Drawn],
    settled: Mapping[Cell, Drawn],
    published: Published,
) -> list[SummaryRow]:
    """Each selection over all policies and seeds, by scene (all scenes first), best success rate first."""
    rows = sorted(rows, key=lambda row: row["scene"] != ALL_SCENES)  # the query's order within
    counts = {key: part.counts for key, part in drawn.items()}
    best = ties(rows, lambda row: counts[cell(row)])
    against = gains(rows, lambda row: counts[cell(row)])
    return [
        SummaryRow(
            **{name: value for name, value in row.items() if name != "settled"},
            success_rate=row["successes"] / row["n"],
            interval=rate_interval(counts[cell(row)]),
            interval_over=drawn[cell(row)].over,
            wilson=wilson_interval(row["successes"], row["n"]),
            settled_rate=row["settled"] / row["n"],
            settled_interval=rate_interval(settled[cell(row)].counts),
            gain=gain,
            published=known.success.rate if (known := published.get(row["selector"])) else None,
            rank=rank(row, rows),
            best=cell(row) in best,
        )
        for row, gain in zip(rows, against, strict=True)
    ]


def rank(row: SqlRow, rows: Sequence[SqlRow]) -> int:
    """1 plus the number of selections in the same scene whose success rate is higher."""
    group = [one for one in rows if (one["scene"], one["pool_label"]) == (row["scene"], row["pool_label"])]
    return 1 + len([one for one in group if one["successes"] * row["n"] > row["successes"] * one["n"]])


def policy_rows(rows: Sequence[SqlRow], drawn: Mapping[Cell, Drawn], published: Published) -> list[PolicyRow]:
    """Each policy on each selection."""

    def counts(row: SqlRow) -> Counts:
        return drawn[cell(row)].by_policy[row["policy"]]

    def known(row: SqlRow) -> float | None:
        rates = published[row["selector"]].by_policy if row["selector"] in published else {}
        return rates[row["policy"]].rate if row["policy"] in rates else None

    return [
        PolicyRow(
            *cell(row),
            policy=row["policy"],
            n=row["n"],
            successes=row["successes"],
            success_rate=row["successes"] / row["n"],
            interval=rate_interval(counts(row)),
            gain=gain,
            published=known(row),
        )
        for row, gain in zip(rows, gains(rows, counts, "policy"), strict=True)
    ]


def distance_rows(
    rows: Sequence[SqlRow], drawn: Mapping[tuple[Cell, int], Counts], published: Published
) -> list[DistanceRow]:
    """Each selection at each distance of the tested from the trained target."""

    def counts(row: SqlRow) -> Counts:
        return drawn[cell(row), row["distance_cm"]]

    def known(row: SqlRow) -> float | None:
        rates = published[row["selector"]].by_distance if row["selector"] in published else {}
        return rates[row["distance_cm"]].rate if row["distance_cm"] in rates else None

    return [
        DistanceRow(
            *cell(row),
            distance_cm=row["distance_cm"],
            n=row["n"],
            successes=row["successes"],
            success_rate=row["successes"] / row["n"],
            interval=rate_interval(counts(row)),
            gain=gain,
            published=known(row),
        )
        for row, gain in zip(rows, gains(rows, counts, "distance_cm"), strict=True)
    ]
