"""Results of a study's trials on one kind of test: success, by policy, by distance, and how rollouts went."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeVar

from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study.against import SqlRow, cell, moments_of, welch_tests
from plancurate.tasks.study.agreement import agreement_rows
from plancurate.tasks.study.means import mean_interval
from plancurate.tasks.study.published import published_for
from plancurate.tasks.study.reference_results import ReferenceRow, reference_row
from plancurate.tasks.study.rows import (
    DistanceRow,
    FailureRow,
    Mean,
    PolicyRow,
    QualityRow,
    ResultRow,
    Row,
    SummaryRow,
)
from plancurate.tasks.study.selection_rows import AgreementRow
from plancurate.tasks.study.statistics import wilson_interval
from plancurate.tasks.study.success_results import Published, distance_rows, policy_rows, summary_rows
from plancurate.tasks.study.trials import Bootstrap, network_trials

Kind = Literal["displaced", "unseen", "unseen_scene"]
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
    references: list[ReferenceRow]
    """What a planner, a replayed trajectory and a straight line reach of the same tests."""


def kind_results(lake: Lake, study: str, kind: Kind) -> KindResults:
    """Compute the results of a study on one kind of test; without rows where it has no such trials."""

    def rows(name: str) -> list[dict[str, Any]]:
        return list(lake.query(f"results/{name}", study=study, kind=kind).to_pylist())

    trials = network_trials(lake.query("results/outcomes", study=study, kind=kind))
    if not trials:
        return KindResults(kind, [], [], [], [], [], [], [], [])
    bootstrap = Bootstrap(trials)
    drawn = bootstrap.draw()
    selectors = rows("by_selector")
    published = published_for(row["selector"] for row in selectors) if kind == "displaced" else {}
    summaries = summary_rows(selectors, drawn, bootstrap.draw("settled"), published)
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
        references=[reference_row(row) for row in rows("references")],
    )


def network_rows(lake: Lake, study: str, kind: Kind) -> list[ResultRow]:
    """One row for each network of a study."""
    return [result_row(row) for row in lake.query("results/networks", study=study, kind=kind).to_pylist()]


def result_row(row: SqlRow) -> ResultRow:
    """One network's rates with Wilson's intervals."""
    success, settled = (wilson_interval(row[name], row["n"]) for name in ("successes", "settled"))
    return ResultRow(
        **row,
        success_rate=row["successes"] / row["n"],
        ci_low=success.low,
        ci_high=success.high,
        settled_rate=row["settled"] / row["n"],
        settled_ci_low=settled.low,
        settled_ci_high=settled.high,
    )


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
