"""Results about a study's selections themselves: their time, what they cover, why some do badly."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from statistics import fmean

from plancurate.tasks.curation.names import STAGES
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study.against import SqlRow, cell
from plancurate.tasks.study.means import mean_interval, moments
from plancurate.tasks.study.published import published_for
from plancurate.tasks.study.rows import Cell, SummaryRow
from plancurate.tasks.study.selection_rows import BelowRandomRow, CoverageRow, PlannerRow, RankingRow, TimeRow

CONTROL = "Random"
PUBLISHED_ELSEWHERE = ("BehaviorRetrieval", "SCIZOR", "CUPID")
"""Selectors of other publications, whose results below Random ask for an explanation."""


def time_rows(rows: Sequence[SqlRow]) -> list[TimeRow]:
    """Mean seconds of each selection over its selection seeds, with Student's interval where there are several."""
    by_cell: dict[Cell, list[SqlRow]] = defaultdict(list)
    for row in rows:
        by_cell[cell(row)].append(row)
    return [_time_row(key, own) for key, own in by_cell.items()]


def _time_row(key: Cell, rows: Sequence[SqlRow]) -> TimeRow:
    total = moments([row["selection_time_s"] for row in rows])
    known = published_for([key.selector]).get(key.selector)
    return TimeRow(
        *key,
        n=len(rows),
        seconds={stage: fmean(row[f"{stage}_s"] for row in rows) for stage in STAGES},
        total=total.mean,
        interval=mean_interval(total) if len(rows) > 1 else None,
        published=known.selection_time_s if known else None,
        published_n=known.selection_times if known else None,
        published_interval=known.selection_time_interval if known else None,
    )


def coverage_rows(rows: Sequence[SqlRow]) -> list[CoverageRow]:
    """What each selection keeps."""
    return [CoverageRow(**row) for row in rows]


def planner_rows(rows: Sequence[SqlRow]) -> list[PlannerRow]:
    """Whose trajectories each selection keeps."""
    return [PlannerRow(**row) for row in rows]


def ranking_rows(lake: Lake, study: str) -> list[RankingRow]:
    """How stably the scores of each selection of a study rank, where they are estimated from rollouts."""
    return [RankingRow(**row) for row in lake.query("results/rankings", study=study).to_pylist()]


def below_random_rows(
    summaries: Sequence[SummaryRow], coverage: Sequence[CoverageRow]
) -> list[BelowRandomRow]:
    """Selectors of other publications with less success than Random's at the same budget, best first."""
    covered = {row.cell: row for row in coverage}
    rates = {row.cell: row.success_rate for row in summaries}
    below = []
    for key, rate in rates.items():
        control = key._replace(selector=CONTROL)
        known = key in covered and control in covered
        if key.selector.partition("(")[0] in PUBLISHED_ELSEWHERE and known and rate < rates.get(control, 0.0):
            own, random = covered[key], covered[control]
            below.append(
                BelowRandomRow(
                    *key,
                    success_rate=rate,
                    random_rate=rates[control],
                    targets_without=own.targets_without,
                    shortest_way=own.shortest_way,
                    random_shortest_way=random.shortest_way,
                    words=reasons(own, random),
                )
            )
    return below


def reasons(own: CoverageRow, random: CoverageRow) -> str:
    """What of a selection's choice explains that it does worse than a random one."""
    words = []
    if own.targets_without > random.targets_without:
        words.append(f"leaves {own.targets_without:g} of {own.targets} targets without data")
    if own.shortest_way < random.shortest_way:
        words.append("keeps more trajectories that go a long way round to another goal configuration")
    return "; ".join(words) or "not explained by coverage or by the way"


def way_correlation(
    summaries: Sequence[SummaryRow], coverage: Sequence[CoverageRow]
) -> tuple[float, int] | None:
    """Rank correlation of success with the share of the shortest way, and over how many selections.

    Only selections that leave no target out count; None for fewer than three or where all go the same ways.
    """
    from scipy import stats  # most of a second, which no --help needs

    rates = {row.cell: row.success_rate for row in summaries}
    whole = [row for row in coverage if row.cell in rates and not row.targets_without]
    ways, success = [row.shortest_way for row in whole], [rates[row.cell] for row in whole]
    if len(set(ways)) < 3 or len(set(success)) < 2:
        return None
    return float(stats.spearmanr(ways, success).statistic), len(whole)
