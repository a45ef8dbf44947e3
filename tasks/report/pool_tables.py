"""Tables about the selections themselves: their time (A5), what they cover and whose trajectories they keep."""

from __future__ import annotations

from plancurate.tasks.curation.selectors.base import STAGES
from plancurate.tasks.curation.selectors.selection import label
from plancurate.tasks.report import text
from plancurate.tasks.report.comparisons import published
from plancurate.tasks.report.contents import Table
from plancurate.tasks.report.rows import CoverageRow, PlannerRow, TimeRow
from plancurate.tasks.report.source import Source, selection


def time_table(source: Source) -> Table[TimeRow]:
    """Table A5: seconds from the loaded candidates to the list of kept ones."""
    rows = [
        TimeRow(
            *selection(row),
            **{stage: row[f"{stage}_s"] for stage in STAGES},
            total=row["selection_time_s"],
            published=getattr(published(row), "selection_time_s", None),
        )
        for row in source.rows("selection_times")
    ]
    return Table(
        key="table_a5",
        title="Table A5. Selection time",
        note="In seconds, one run of each selection on this study's machine and pool; the publication's are of "
        "another machine and pool.",
        rows=rows,
        headers=("selector", "k", *(stage.replace("_", " ") for stage in STAGES), "in all", "published"),
        cells=[
            [row.selector, text.budget(row.budget)]
            + [text.seconds(getattr(row, stage)) for stage in (*STAGES, "total", "published")]
            for row in rows
        ],
        queries=[source.query("selection_times")],
    )


def coverage_table(source: Source) -> Table[CoverageRow]:
    """What each selection keeps: of each target, of the planners, of the goal configurations."""
    rows = [CoverageRow(**row) for row in source.rows("study_coverage")]
    planners = len(source.config.get("planners", ()))
    return Table(
        key="coverage",
        title="What the selections cover",
        note="Kept trajectories a target (a target without any counts as 0), how many of all kept ones differ, "
        "planners and goal configurations among them, percent that lead to the goal configuration of their target's "
        "shortest candidate, and percent of their steps that is learnt from. More goal configurations than targets "
        "mean several ways to the same place in one training set.",
        rows=rows,
        headers=("selector", "k", "kept", "of pool", "least a target", "median", "most", "targets without",
                 "distinct", "planners", "goal configurations", "shortest way", "steps"),
        cells=[
            [row.selector, text.budget(row.budget), str(row.kept), str(row.pool), str(row.least_per_target),
             f"{row.median_per_target:g}", str(row.most_per_target), f"{row.targets_without} of {row.targets}",
             str(row.distinct_kept), f"{row.planners} of {planners}" if planners else str(row.planners),
             str(row.goal_configurations), text.percent(row.shortest_way), text.percent(row.share_of_steps)]
            for row in rows
        ],
        queries=[source.query("study_coverage")],
    )  # fmt: skip


def planners_table(source: Source) -> Table[PlannerRow]:
    """Share of each planner in each selection."""
    rows = [PlannerRow(**row) for row in source.rows("planners_kept")]
    shares = {(row.planner, row.selector, row.budget): row.share for row in rows}
    return Table(
        key="planners",
        title="Whose trajectories the selections keep",
        note="Share of each planner in percent of what the selection keeps.",
        rows=rows,
        headers=("planner", *(label(*chosen) for chosen in source.order)),
        cells=[
            [planner, *(text.percent(shares.get((planner, *chosen))) for chosen in source.order)]
            for planner in sorted({row.planner for row in rows})
        ],
        queries=[source.query("planners_kept")],
    )
