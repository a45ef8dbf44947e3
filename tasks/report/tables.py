"""Tables A1 to A4 of the publication: success by selector, policy and distance, quality of the rollouts."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from plancurate.tasks.report import text
from plancurate.tasks.report.comparisons import (
    Row,
    against_general,
    by_successes,
    outcomes,
    published,
    published_rate,
)
from plancurate.tasks.report.contents import Table
from plancurate.tasks.report.published import PublishedResult
from plancurate.tasks.report.rows import DistanceRow, Mean, PolicyRow, QualityRow, SuccessRow
from plancurate.tasks.report.source import Selection, Source, selection
from plancurate.tasks.study.statistics import (
    Interval,
    Moments,
    Outcomes,
    Test,
    cluster_bootstrap_interval,
    mean_interval,
    welch_test,
    wilson_interval,
)

STARS = "Stars: differs from General with p below 0.05 (*), 0.01 (**) or 0.001 (***), ns: it may be chance."
HOLM = "Holm p is adjusted for all tests of this table."
MEASURES = ("final_distance", "path_length", "joint_movement")


def success_rows(source: Source) -> list[SuccessRow]:
    """Table A1: each selection over all policies and training seeds, best first."""
    rows = source.rows("by_selector")
    drawn = network_intervals(source.rows("by_policy"))
    return [
        SuccessRow(
            *selection(row),
            n=row["n"],
            successes=row["successes"],
            rate=row["successes"] / row["n"],
            wilson=wilson_interval(row["successes"], row["n"]),
            networks=drawn[selection(row)],
            settled_rate=row["settled"] / row["n"],
            against_general=compared,
            published=None if source.kind == "unseen" else published_rate(row, lambda found: found.success),
        )
        for row, compared in zip(rows, against_general(rows, by_successes), strict=True)
    ]


def network_intervals(rows: Sequence[Row]) -> dict[Selection, Interval | None]:
    """Interval of each selection's success rate when its networks are drawn again, policy by policy.

    None where a policy has one network only: that shows nothing of how networks vary.
    """
    networks: dict[Selection, list[Row]] = defaultdict(list)
    for row in rows:
        networks[row["selector"], row["budget"]].append(row)
    intervals: dict[Selection, Interval | None] = {}
    for key, found in networks.items():
        policies = [row["policy"] for row in found]
        several = min(Counter(policies).values()) > 1
        drawn = [outcomes(row) for row in found]
        intervals[key] = cluster_bootstrap_interval(drawn, strata=policies) if several else None
    return intervals


def success_table(source: Source) -> Table[SuccessRow]:
    """Table A1, or the same about fresh targets."""
    rows = success_rows(source)
    fresh = source.kind == "unseen"
    note = (
        "In percent, all policies together. Wilson takes every test for independent; the interval over networks "
        "draws trained networks again, which needs several training seeds. Settled: still at the target at the "
        f"step limit. {STARS} {HOLM}"
    )
    return Table(
        key="unseen" if fresh else "table_a1",
        title="Success at fresh targets by selector" if fresh else "Table A1. Success by selector",
        note=note,
        rows=rows,
        headers=("selector", "k", "n", "success", "success %", "published %", "Wilson 95 %", "networks 95 %",
                 "vs General", "z", "p", "Holm p", "settled %"),
        cells=[
            [row.selector, text.budget(row.budget), str(row.n), str(row.successes), text.percent(row.rate),
             text.percent(row.published), text.percents(row.wilson), text.percents(row.networks), *_test(row),
             text.percent(row.settled_rate)]
            for row in rows
        ],
        queries=[source.query("by_selector"), source.query("by_policy")],
    )  # fmt: skip


def policy_table(source: Source) -> Table[PolicyRow]:
    """Table A2: each policy on each selection."""
    rows = source.rows("by_policy_total")
    typed = [
        PolicyRow(
            *selection(row),
            policy=row["policy"],
            n=row["n"],
            successes=row["successes"],
            rate=row["successes"] / row["n"],
            wilson=wilson_interval(row["successes"], row["n"]),
            against_general=compared,
            published=published_rate(row, _policy(row["policy"])),
        )
        for row, compared in zip(rows, against_general(rows, by_successes, "policy"), strict=True)
    ]
    policies = sorted({row.policy for row in typed})
    shown = {
        (row.selector, row.budget, row.policy): text.with_published(
            f"{text.percent(row.rate)} {text.stars(row.against_general)}".strip(),
            text.percent(row.published),
        )
        for row in typed
    }
    return Table(
        key="table_a2",
        title="Table A2. Success by selector and policy",
        note=f"In percent; in parentheses the publication's. {STARS} Intervals and Holm p: report.json.",
        rows=typed,
        headers=("selector", "k", *policies),
        cells=pivot(source.order, policies, shown),
        queries=[source.query("by_policy_total")],
    )


def distance_table(source: Source) -> Table[DistanceRow]:
    """Table A3: each selection by how far the tested is from the trained target."""
    typed = [
        DistanceRow(
            *selection(row),
            distance_cm=row["distance_cm"],
            n=row["n"],
            successes=row["successes"],
            rate=row["successes"] / row["n"],
            wilson=wilson_interval(row["successes"], row["n"]),
            published=published_rate(row, _distance(row["distance_cm"])),
        )
        for row in source.rows("by_distance")
    ]
    distances = sorted({row.distance_cm for row in typed})
    shown = {
        (row.selector, row.budget, row.distance_cm): text.with_published(
            text.percent(row.rate), text.percent(row.published)
        )
        for row in typed
    }
    return Table(
        key="table_a3",
        title="Table A3. Success by distance of the tested from the trained target",
        note="In percent; in parentheses the publication's. Intervals: report.json.",
        rows=typed,
        headers=("selector", "k", *(f"{distance} cm" for distance in distances)),
        cells=pivot(source.order, distances, shown),
        queries=[source.query("by_distance")],
    )


def quality_table(source: Source) -> Table[QualityRow]:
    """Table A4: final distance, path length and joint movement of the rollouts."""
    rows = source.rows("quality")
    means = {name: quality_means(rows, name) for name in MEASURES}
    typed = [
        QualityRow(*selection(row), row["n"], *(means[name][i] for name in MEASURES))
        for i, row in enumerate(rows)
    ]
    headers = ("final distance, m", "path length, m", "joint movement, rad")
    return Table(
        key="table_a4",
        title="Table A4. How the rollouts went",
        note="Mean over all tests with its 95 % t-interval, when the rollout ended: at the target, at a broken rule "
        f"or at the step limit. Welch's t-test against General. {STARS} Holm p for each measure: report.json.",
        rows=typed,
        headers=("selector", "k", *(name for header in headers for name in (header, "published"))),
        cells=[
            [row.selector, text.budget(row.budget)]
            + [
                words
                for value in (row.final_distance, row.path_length, row.joint_movement)
                for words in (text.mean(value), text.decimals(value.published))
            ]
            for row in typed
        ],
        queries=[source.query("quality")],
    )


def quality_means(rows: Sequence[Row], name: str) -> list[Mean]:
    """A measure's mean of each row, with interval and Welch's test against General."""

    def spread(row: Row) -> Moments:
        return Moments(row[name], row[f"{name}_std"], row["n"])

    def welch(row: Row, base: Row) -> Test:
        return welch_test(spread(row), spread(base))

    return [
        Mean(row[name], mean_interval(spread(row)), compared, getattr(published(row), name, None))
        for row, compared in zip(rows, against_general(rows, welch), strict=True)
    ]


def pivot(
    order: Sequence[Selection], columns: Sequence[Any], shown: Mapping[tuple[Any, ...], str]
) -> list[list[str]]:
    """One line a selection, one cell a column."""
    return [
        [name, text.budget(number), *(shown.get((name, number, column), text.NOTHING) for column in columns)]
        for name, number in order
    ]


def _test(row: SuccessRow) -> list[str]:
    test = row.against_general
    if test is None:
        return [""] * 4
    return [test.stars, f"{test.statistic:.2f}", text.probability(test.p), text.probability(test.holm_p)]


def _policy(name: str) -> Callable[[PublishedResult], Outcomes | None]:
    return lambda found: found.by_policy.get(name)


def _distance(cm: int) -> Callable[[PublishedResult], Outcomes | None]:
    return lambda found: found.by_distance.get(cm)
