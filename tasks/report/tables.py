"""Tables A1 to A4 of the publication: success by selector, policy and distance, quality of the rollouts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from plancurate.tasks.report.contents import Table
from plancurate.tasks.report.source import FRESH_TITLES, Source
from plancurate.tasks.study import text
from plancurate.tasks.study.reference_results import ReferenceRow
from plancurate.tasks.study.rows import (
    Cell,
    DistanceRow,
    Gain,
    PlainTest,
    PolicyRow,
    QualityRow,
    Row,
    SummaryRow,
)

STARS = (
    "Stars: differs from General on the same test targets with p below 0.05 (*), 0.01 (**) or 0.001 (***) after Holm's "
    "adjustment for all tests of one scene in this table; ns: it may be chance."
)
REFERENCES = (
    "The last lines are no selections, each test counted once: Planner, whether a planner reaches the target (the "
    "ceiling; displaced tests that it does not reach are left out); Replay, the best trajectory to the nearest "
    "training target, unchanged; StraightLine, in joint space to the goal configuration nearest to the start. They "
    "settle where they succeed."
)
PLAIN = "The publication's own test takes every trial for independent and adjusts nothing; its stars say too much."
MOTIONS = (
    " Motions: of the n rollouts that reached their target and were timed and verified, the share that the robot may "
    "run."
)
MEASURES = {
    "final_distance": "final distance, m",
    "settled_distance": "distance at the step limit, m",
    "path_length": "path length, m",
    "joint_movement": "joint movement, rad",
}


def success_table(source: Source) -> Table[SummaryRow]:
    """Table A1, or the same about fresh targets."""
    fresh = source.kind != "displaced"
    rows = source.tests.summaries
    motions = any(row.motions for row in rows)
    return Table(
        key=source.kind if fresh else "table_a1",
        title=f"{FRESH_TITLES[source.kind]} by selector" if fresh else "Table A1. Success by selector",
        note="In percent, all policies together, with a 95 % interval (bootstrap over selection "
        "seeds, training seeds and test targets; one of a kind shows no spread and adds none) and "
        f"the gain over General in points. {STARS} Best: the first of its scene; tie: the tests can't tell it from the "
        "first. Hard: of the n trials whose target's straight joint line, from the start to the nearest goal "
        f"configuration, is not free.{MOTIONS if motions else ''} {REFERENCES} {PLAIN} Wilson's interval likewise.",
        rows=rows,
        references=source.references,
        headers=(*source.headers, "n", "success %", *(() if fresh else ("published %",)), "95 %",
                 "selection seeds x training seeds x targets", "",
                 "gain", "95 %", "Holm p", "settled %", "95 %", "hard %", "n", *(("motions %", "n") if motions else ()),
                 "publication's: Wilson 95 %", "z", "p"),
        cells=[
            [*source.heads(row), str(row.n), text.percent(row.success_rate),
             *(() if fresh else (text.percent(row.published),)), text.percents(row.interval),
             f"{row.selection_seeds} x {row.training_seeds} x {row.tests}",
             standing(row), *gain_cells(row.gain), text.percent(row.settled_rate), text.percents(row.settled_interval),
             text.percent(row.hard_rate), str(row.hard_n),
             *((text.percent(row.motion_rate), str(row.motions)) if motions else ()),
             text.percents(row.wilson), *plain_cells(row.gain.z_test if row.gain else None)]
            for row in rows
        ] + [reference_cells(source, row, fresh, motions) for row in source.references],
        queries=[
            source.query("by_selector", kind=True),
            source.query("outcomes", kind=True),
            *([source.query("references", kind=True)] if source.references else []),
        ],
    )  # fmt: skip


def reference_cells(source: Source, row: ReferenceRow, fresh: bool, motions: bool) -> list[str]:
    """A reference's line of the success table, whose columns depend on what was tested."""
    rate, interval = text.percent(row.success_rate), text.percents(row.interval)
    return [
        *source.group_cells(row), row.reference, text.NOTHING, str(row.n), rate, *(() if fresh else ("",)), interval,
        f"{row.n} targets", "reference", "", "", "", rate, interval, text.percent(row.hard_rate), str(row.hard_n),
        *(("", "") if motions else ()), interval, "", "",
    ]  # fmt: skip


def policy_table(source: Source) -> Table[PolicyRow]:
    """Table A2: each policy on each selection."""
    rows = source.tests.policies
    policies = sorted({row.policy for row in rows})
    shown = {(row.cell, row.policy): rate_cell(row.success_rate, row.gain, row.published) for row in rows}
    return Table(
        key="table_a2",
        title="Table A2. Success by selector and policy",
        note=f"In percent; in parentheses the publication's. {STARS} report.json has intervals, p and "
        "the publication's z-tests.",
        rows=rows,
        headers=(*source.headers, *policies),
        cells=pivot(source, rows, policies, shown),
        queries=[source.query("by_policy", kind=True), source.query("outcomes", kind=True)],
    )


def distance_table(source: Source) -> Table[DistanceRow]:
    """Table A3: each selection by how far the tested is from the trained target."""
    rows = source.tests.distances
    distances = sorted({row.distance_cm for row in rows})
    shown = {
        (row.cell, row.distance_cm): rate_cell(row.success_rate, row.gain, row.published) for row in rows
    }
    return Table(
        key="table_a3",
        title="Table A3. Success by distance of the tested from the trained target",
        note=f"In percent; in parentheses the publication's. {STARS} report.json has intervals, p and "
        "the publication's z-tests.",
        rows=rows,
        headers=(*source.headers, *(f"{distance} cm" for distance in distances)),
        cells=pivot(source, rows, distances, shown),
        queries=[source.query("by_distance", kind=True), source.query("outcomes", kind=True)],
    )


def quality_table(source: Source) -> Table[QualityRow]:
    """Table A4: final distance, path length and joint movement of the rollouts."""
    rows = source.tests.quality
    return Table(
        key="table_a4",
        title="Table A4. How the rollouts went",
        note="Mean over all tests with its 95 % t-interval, when the rollout ended: at the target, at a broken rule "
        "or at the step limit. The distance at the step limit is of rollouts that go on after success. Stars are "
        "the publication's: Welch's t-test against General over all trials, taken for independent.",
        rows=rows,
        headers=(*source.headers, *(h for name, header in MEASURES.items() for h in measure_headers(name, header))),
        cells=[
            [*source.heads(row), *(c for name in MEASURES for c in measure_cells(row, name))] for row in rows
        ],
        queries=[source.query("quality", kind=True)],
    )  # fmt: skip


def standing(row: SummaryRow) -> str:
    """Whether a selection is the best of its scene, or ties with the best."""
    if not row.best:
        return ""
    return "best" if row.rank == 1 else "tie"


def gain_cells(gain: Gain | None) -> list[str]:
    """Gain over General with stars, its interval and Holm's p."""
    if gain is None:
        return [""] * 3
    return [
        f"{text.points(gain.value)} {gain.stars}",
        text.percents(gain.interval),
        text.probability(gain.holm_p),
    ]


def plain_cells(test: PlainTest | None) -> list[str]:
    """Statistic and p with stars of a test of the publication's kind."""
    return ["", ""] if test is None else [f"{test.statistic:.2f}", f"{text.probability(test.p)} {test.stars}"]


def rate_cell(rate: float, gain: Gain | None, published: float | None) -> str:
    """A rate with its stars and the publication's."""
    ours = f"{text.percent(rate)} {gain.stars}" if gain else text.percent(rate)
    return text.with_published(ours, published)


def measure_headers(name: str, header: str) -> tuple[str, ...]:
    """Heads of a measure's columns; the publication has no distance at the step limit."""
    return (header,) if name == "settled_distance" else (header, "published")


def measure_cells(row: QualityRow, name: str) -> list[str]:
    """A measure's mean and the publication's."""
    mean = getattr(row, name)
    return (
        [text.mean(mean)] if name == "settled_distance" else [text.mean(mean), text.decimals(mean.published)]
    )


def pivot(
    source: Source, rows: Sequence[Row], columns: Sequence[Any], shown: Mapping[tuple[Cell, Any], str]
) -> list[list[str]]:
    """One line a selection, one cell a column."""
    lines = {row.cell: row for row in rows}
    return [
        [*source.heads(row), *(shown.get((cell, column), text.NOTHING) for column in columns)]
        for cell, row in lines.items()
    ]
