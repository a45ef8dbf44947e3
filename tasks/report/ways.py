"""Why a selection does well or badly: which way its trajectories go, and which targets it leaves out."""

from __future__ import annotations

from scipy import stats

from plancurate.tasks.report import text
from plancurate.tasks.report.charts import Point, scatter
from plancurate.tasks.report.contents import Figure, Table
from plancurate.tasks.report.rows import BelowRandomRow, CoverageRow
from plancurate.tasks.report.source import Selection, Source, is_base, selection

CONTROL = "Random"
PUBLISHED = ("BehaviorRetrieval", "SCIZOR", "CUPID")
TITLE = "Success by the way that the kept trajectories go"


def ways_figure(source: Source) -> Figure:
    """A point for each selection: success against the share that goes the shortest way."""
    covered = coverage(source)
    points = [
        Point(covered[selection(row)].shortest_way, row["successes"] / row["n"], kind(row, covered))
        for row in source.rows("by_selector")
        if selection(row) in covered
    ]
    drawing = scatter(TITLE, "take the shortest way of their target, %", "success, %", points)
    legend = [("ours", "a selection"), ("base", "General"), ("published", "leaves targets without data")]
    return Figure("figure_ways", TITLE, correlation(source), [("", drawing)], legend)


def kind(row: dict[str, object], covered: dict[Selection, CoverageRow]) -> str:
    """How a selection is drawn."""
    if is_base(row):
        return "base"
    return "published" if covered[selection(row)].targets_without else "ours"


def correlation(source: Source) -> str:
    """How closely success follows the way, in a sentence."""
    covered = coverage(source)
    whole = [
        (covered[selection(row)].shortest_way, row["successes"] / row["n"])
        for row in source.rows("by_selector")
        if selection(row) in covered and not covered[selection(row)].targets_without
    ]
    words = (
        "Across are the percent of a selection's trajectories that end in the goal configuration of their target's "
        "shortest candidate. Where it is far from 100, the same observation comes with different actions."
    )
    if len({way for way, _ in whole}) < 3:
        return words
    rank = stats.spearmanr(*zip(*whole, strict=True)).statistic
    return f"{words} Rank correlation over the {len(whole)} selections that leave no target out: {rank:.2f}."


def below_random(source: Source) -> list[BelowRandomRow]:
    """The published selectors whose success is below Random's at the same budget, best first."""
    covered = coverage(source)
    rates = {selection(row): row["successes"] / row["n"] for row in source.rows("by_selector")}
    found = []
    for (name, budget), rate in rates.items():
        control = (CONTROL, budget)
        if name in PUBLISHED and budget is not None and rate < rates.get(control, 0.0):
            own, random = covered[name, budget], covered[control]
            found.append(
                BelowRandomRow(
                    name,
                    budget,
                    rate,
                    rates[control],
                    own.targets_without,
                    own.shortest_way,
                    random.shortest_way,
                    words(own, random),
                )
            )
    return found


def words(own: CoverageRow, random: CoverageRow) -> str:
    """What of a selection's choice explains that it does worse than a random one."""
    reasons = []
    if own.targets_without > random.targets_without:
        reasons.append(f"leaves {own.targets_without} of {own.targets} targets without data")
    if own.shortest_way < random.shortest_way:
        reasons.append("keeps more trajectories that go a long way round to another goal configuration")
    return "; ".join(reasons) or "not explained by coverage or by the way"


def below_random_table(source: Source) -> Table[BelowRandomRow]:
    """The published selectors below Random, with what explains it."""
    rows = below_random(source)
    return Table(
        key="below_random",
        title="Published selectors below Random at the same budget",
        note="In percent. The reasons are read from the coverage table.",
        rows=rows,
        headers=(
            "selector",
            "k",
            "success",
            "Random's",
            "targets without",
            "shortest way",
            "Random's",
            "in words",
        ),
        cells=[
            [
                row.selector,
                str(row.budget),
                text.percent(row.rate),
                text.percent(row.random_rate),
                str(row.targets_without),
                text.percent(row.shortest_way),
                text.percent(row.random_shortest_way),
                row.words,
            ]
            for row in rows
        ],
        queries=[source.query("by_selector"), source.query("study_coverage")],
    )


def coverage(source: Source) -> dict[Selection, CoverageRow]:
    """The coverage of each selection that the lake records."""
    return {selection(row): CoverageRow(**row) for row in source.rows("study_coverage")}
