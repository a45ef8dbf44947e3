"""Tables about the selections themselves: their time (A5), what they cover, whose trajectories they keep, reasons."""

from __future__ import annotations

from plancurate.tasks.curation.names import STAGES
from plancurate.tasks.report.contents import Table
from plancurate.tasks.report.source import Source
from plancurate.tasks.study import text
from plancurate.tasks.study.selection_rows import (
    AgreementRow,
    BelowRandomRow,
    CoverageRow,
    PlannerRow,
    PoolRow,
    RankingRow,
    TimeRow,
)


def time_table(source: Source) -> Table[TimeRow]:
    """Table A5: seconds from the loaded candidates to the list of kept ones."""
    rows = source.results.times
    return Table(
        key="table_a5",
        title="Table A5. Selection time",
        note="In seconds on this study's machine and pool: the mean over n selections, one a selection seed, with "
        "its 95 % t-interval where there are several; the publication's are of another machine and pool.",
        rows=rows,
        headers=(*source.headers, "n", *(stage.replace("_", " ") for stage in STAGES), "in all", "95 %",
                 "published", "n", "95 %"),
        cells=[
            [*source.heads(row), str(row.n), *(text.seconds(row.seconds[stage]) for stage in STAGES),
             text.seconds(row.total),
             text.seconds_interval(row.interval), text.seconds(row.published),
             text.NOTHING if row.published_n is None else str(row.published_n),
             text.seconds_interval(row.published_interval)]
            for row in rows
        ],
        queries=[source.query("selection_times")],
    )  # fmt: skip


def coverage_table(source: Source) -> Table[CoverageRow]:
    """What each selection keeps: of each target, of the planners, of the goal configurations."""
    rows = source.results.coverage
    planners = len(source.results.study.pools[0].planners)
    return Table(
        key="coverage",
        title="What the selections cover",
        note="Kept trajectories a target (a target without any counts as 0), how many of all kept ones differ, "
        "planners and goal configurations among them, percent that lead to the goal configuration of their target's "
        "shortest candidate, and percent of their steps that is learnt from; on average over seeds. More goal "
        "configurations than targets mean several ways to the same place in one training set.",
        rows=rows,
        headers=(*source.headers, "kept", "of pool", "least a target", "median", "most", "targets without",
                 "distinct", "planners", "goal configurations", "shortest way", "steps"),
        cells=[
            [*source.heads(row), f"{row.kept:g}", str(row.pool), str(row.least_per_target),
             f"{row.median_per_target:g}", str(row.most_per_target), f"{row.targets_without:g} of {row.targets}",
             f"{row.distinct_kept:g}", f"{row.planners:.3g} of {planners}",
             f"{row.goal_configurations:g}", text.percent(row.shortest_way), text.percent(row.share_of_steps)]
            for row in rows
        ],
        queries=[source.query("coverage")],
    )  # fmt: skip


def planners_table(source: Source) -> Table[PlannerRow]:
    """Share of each planner in each selection."""
    rows = source.results.planners
    columns = {row.cell: row for row in rows}
    shares = {(row.planner, row.cell): row.share for row in rows}
    return Table(
        key="planners",
        title="Whose trajectories the selections keep",
        note="Share of each planner in percent of what the selection keeps.",
        rows=rows,
        headers=("planner", *(", ".join([*source.group_cells(row), row.name]) for row in columns.values())),
        cells=[
            [planner, *(text.percent(shares.get((planner, cell))) for cell in columns)]
            for planner in sorted({row.planner for row in rows})
        ],
        queries=[source.query("planners_kept")],
    )


def pool_table(source: Source) -> Table[PoolRow]:
    """How many candidates of each pool differ."""
    rows = source.results.pools
    return Table(
        key="pools",
        title="The candidates to select from",
        note="Solved and verified candidates of the study's own planners and targets, and how many differ. A way is a "
        "class of goal configurations and a class of paths to it; goal configurations and ways are means over "
        "targets. A pool in which fewer than a third differ is degenerate: selections from it can hardly differ.",
        rows=rows,
        headers=("scene", "pool", "targets", "candidates", "distinct", "distinct %", "distinct a target",
                 "goal configurations", "ways", ""),
        cells=[
            [row.scene, row.pool_label or text.NOTHING, str(row.targets), str(row.candidates), str(row.distinct),
             text.percent(row.distinct_share), f"{row.distinct_a_target:.1f}",
             text.decimals(row.goal_classes), text.decimals(row.ways), "degenerate" if row.degenerate else ""]
            for row in rows
        ],
        queries=[source.query("equal_candidates")],
    )  # fmt: skip


def ranking_table(source: Source) -> Table[RankingRow]:
    """How stably scores from rollouts rank."""
    rows = source.results.rankings
    return Table(
        key="rankings",
        title="How stably scores from rollouts rank",
        note="Split-half: Spearman's correlation of the scores that every other rollout gives with those of the rest, "
        "the mean over n selections, one a selection seed, and the least. With all rollouts the order is steadier: a "
        "split-half correlation r stands for one of 2 r / (1 + r).",
        rows=rows,
        headers=(*source.headers, "n", "split-half", "least"),
        cells=[
            [*source.heads(row), str(row.selections), f"{row.split_half:.2f}", f"{row.least:.2f}"]
            for row in rows
        ],
        queries=[source.query("rankings")],
    )


def below_random_table(source: Source) -> Table[BelowRandomRow]:
    """Selectors of other publications below Random, with what explains it."""
    rows = source.results.below_random
    return Table(
        key="below_random",
        title="Published selectors below Random at the same budget",
        note="In percent. The reasons are read from the coverage table.",
        rows=rows,
        headers=(*source.headers, "success", "Random's", "targets without", "shortest way", "Random's", "in words"),
        cells=[
            [*source.heads(row), text.percent(row.success_rate), text.percent(row.random_rate),
             f"{row.targets_without:g}", text.percent(row.shortest_way), text.percent(row.random_shortest_way),
             row.words]
            for row in rows
        ],
        queries=[source.query("by_selector", kind=True), source.query("coverage")],
    )  # fmt: skip


def agreement_table(source: Source) -> Table[AgreementRow]:
    """Gains over General beside the publication's."""
    rows = source.tests.agreement
    return Table(
        key="agreement",
        title="Gain over General, here and in the publication",
        note="In percentage points of success. Ours has its bootstrap interval; the publication's is over its four "
        "policies and 320 tests, taken for independent. Beyond chance: p below 0.05.",
        rows=rows,
        headers=(*source.headers, "gain", "95 %", "published gain", "ours less theirs", "95 %", "in words"),
        cells=[
            [*source.heads(row), text.points(row.gain), text.percents(row.interval), text.points(row.published_gain),
             text.points(row.difference), text.percents(row.difference_interval), row.verdict]
            for row in rows
        ],
        queries=[source.query("by_selector", kind=True)],
    )  # fmt: skip
