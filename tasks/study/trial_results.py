"""Results of a study's trials on one kind of test: success, by policy, by distance, and how rollouts went."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeVar

from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study.against import SqlRow, cell, gains, moments_of, ties, welch_tests
from plancurate.tasks.study.agreement import agreement_rows
from plancurate.tasks.study.bootstrap import Counts, rate_interval
from plancurate.tasks.study.means import mean_interval
from plancurate.tasks.study.published import PublishedResult, published_results
from plancurate.tasks.study.rows import (
    ALL_SCENES,
    AgreementRow,
    Cell,
    DistanceRow,
    FailureRow,
    Mean,
    PolicyRow,
    QualityRow,
    ResultRow,
    Row,
    SummaryRow,
)
from plancurate.tasks.study.statistics import wilson_interval
from plancurate.tasks.study.trials import Bootstrap, Drawn, network_trials

Kind = Literal["displaced", "unseen"]
Published = Mapping[str, PublishedResult]
MEASURES = ("final_distance", "settled_distance", "path_length", "joint_movement")
RowT = TypeVar("RowT", bound=Row)


@dataclass(frozen=True)
class KindResults:
    """Results on one kind of test. Rows: all scenes first, then each scene; in each the best selection first."""

    kind: Kind
    networks: list[ResultRow]
    summaries: list[SummaryRow]
    policies: list[PolicyRow]
    distances: list[DistanceRow]
    """Empty for unseen targets."""
    quality: list[QualityRow]
    failures: list[FailureRow]
    """The commonest reason of each selection first."""
    agreement: list[AgreementRow]
    """Empty for unseen targets, which the publication did not test."""


def kind_results(lake: Lake, study: str, kind: Kind) -> KindResults:
    """Compute the results of a study on one kind of test; without rows where it has no such trials."""

    def rows(name: str) -> list[dict[str, Any]]:
        return list(lake.query(f"results/{name}", study=study, kind=kind).to_pylist())

    trials = network_trials(lake.query("results/outcomes", study=study, kind=kind))
    if not trials:
        return KindResults(kind, [], [], [], [], [], [], [])
    published = published_results() if kind == "displaced" else {}
    bootstrap = Bootstrap(trials)
    drawn = bootstrap.draw()
    summaries = summary_rows(rows("by_selector"), drawn, bootstrap.draw("settled"), published)
    distances = distance_rows(rows("by_distance"), bootstrap.by_distance(), published)
    return KindResults(
        kind=kind,
        networks=in_order(network_rows(lake, study, kind), summaries),
        summaries=summaries,
        policies=in_order(policy_rows(rows("by_policy"), drawn, published), summaries),
        distances=in_order(distances, summaries),
        quality=in_order(quality_rows(rows("quality"), published), summaries),
        failures=in_order([FailureRow(**row) for row in rows("failures")], summaries),
        agreement=agreement_rows(summaries, published),
    )


def network_rows(lake: Lake, study: str, kind: Kind) -> list[ResultRow]:
    """One row for each network of a study."""
    return [result_row(row) for row in lake.query("results/networks", study=study, kind=kind).to_pylist()]


def result_row(row: SqlRow) -> ResultRow:
    """One network's rates with Wilson's intervals."""
    success, settled = (wilson_interval(row[name], row["n"]) for name in ("successes", "settled"))
    return ResultRow(
        **{name: value for name, value in row.items() if name != "settled"},
        success_rate=row["successes"] / row["n"],
        ci_low=success.low,
        ci_high=success.high,
        settled_rate=row["settled"] / row["n"],
        settled_ci_low=settled.low,
        settled_ci_high=settled.high,
    )


def summary_rows(
    rows: Sequence[SqlRow],
    drawn: Mapping[Cell, Drawn],
    settled: Mapping[Cell, Drawn],
    published: Published,
) -> list[SummaryRow]:
    """Each selection over all policies and seeds, by scene (all scenes first), best success rate first."""
    rows = sorted(rows, key=lambda row: row["scene"] != ALL_SCENES)  # the query's order within
    counts = {key: found.counts for key, found in drawn.items()}
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
        found = published[row["selector"]].by_policy if row["selector"] in published else {}
        return found[row["policy"]].rate if row["policy"] in found else None

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
        found = published[row["selector"]].by_distance if row["selector"] in published else {}
        return found[row["distance_cm"]].rate if row["distance_cm"] in found else None

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


def quality_rows(rows: Sequence[SqlRow], published: Published) -> list[QualityRow]:
    """Means of how each selection's rollouts went."""
    means = {measure: measure_means(rows, measure, published) for measure in MEASURES}
    return [
        QualityRow(*cell(row), row["n"], *(means[measure][i] for measure in MEASURES))
        for i, row in enumerate(rows)
    ]


def measure_means(rows: Sequence[SqlRow], measure: str, published: Published) -> list[Mean]:
    """A measure's mean in each row, with its t-interval and Welch's test against General."""
    return [
        Mean(
            row[measure],
            mean_interval(moments_of(row, measure)),
            test,
            getattr(published.get(row["selector"]), measure, None),
        )
        for row, test in zip(rows, welch_tests(rows, measure), strict=True)
    ]


def in_order(rows: list[RowT], summaries: Sequence[SummaryRow]) -> list[RowT]:
    """Rows in the order of the summaries; those of selections without trials last."""
    order = {row.cell: i for i, row in enumerate(summaries)}
    return sorted(rows, key=lambda row: order.get(row.cell, len(order)))
