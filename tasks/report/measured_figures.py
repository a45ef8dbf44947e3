"""Figures 3, A2 and A3 of the publication, about rollouts and selection times, and success by ways."""

from __future__ import annotations

from plancurate.tasks.report.charts import Mark, Point, bars, forest, scatter
from plancurate.tasks.report.contents import Figure
from plancurate.tasks.report.figures import GENERAL_LINE, LEGEND
from plancurate.tasks.report.source import Source
from plancurate.tasks.report.tables import MEASURES
from plancurate.tasks.study import text
from plancurate.tasks.study.against import BASELINE
from plancurate.tasks.study.rows import Mean, QualityRow
from plancurate.tasks.study.selection_results import way_correlation

WAYS = "Success by the way that the kept trajectories go"


def quality_bars(source: Source) -> Figure:
    """Figure 3: final distance, path length and joint movement by selector."""
    title = "Figure 3. How the rollouts went"
    pictures = [
        (words, bars(f"{title}: {words}", words, quality_marks(source, name), text.decimals))
        for name, words in MEASURES.items()
    ]
    note = (
        f"{source.figure_note(source.tests.quality)} Means over all tests; stars: Welch's test, as published."
    )
    return Figure("figure_3", title, note, pictures, LEGEND)


def quality_forest(source: Source) -> Figure:
    """Figure A2: the same against General's, on logarithmic scales."""
    title = "Figure A2. Rollouts against General"
    pictures = [
        (
            words,
            forest(
                f"{title}: {words}",
                f"{words} (logarithmic)",
                quality_marks(source, name),
                text.decimals,
                logarithmic=True,
            ),
        )
        for name, words in MEASURES.items()
    ]
    note = source.figure_note(source.tests.quality)
    return Figure("figure_a2", title, note, pictures, (*LEGEND, GENERAL_LINE))


def time_forest(source: Source) -> Figure:
    """Figure A3: selection time."""
    title = "Figure A3. Selection time"
    marks = [
        Mark(
            row.selector,
            row.total,
            row.interval.low if row.interval else None,
            row.interval.high if row.interval else None,
            published=row.published,
            base=row.selector == BASELINE,
        )
        for row in source.figure_rows(source.results.times)
    ]
    drawing = forest(title, "selection time, s (logarithmic)", marks, text.seconds, logarithmic=True)
    note = f"{source.figure_note(source.results.times)} Intervals are over selection seeds, where there are several."
    return Figure("figure_a3", title, note, [(title, drawing)], (*LEGEND, GENERAL_LINE))


def ways_figure(source: Source) -> Figure:
    """A point for each selection: success against the share that goes the shortest way."""
    covered = {row.cell: row for row in source.results.coverage}
    points = [
        Point(
            covered[row.cell].shortest_way,
            row.success_rate,
            "base"
            if row.selector == BASELINE
            else "published"
            if covered[row.cell].targets_without
            else "ours",
        )
        for row in source.tests.summaries
        if row.cell in covered
    ]
    drawing = scatter(WAYS, "take the shortest way of their target, %", "success, %", points)
    legend = [("ours", "a selection"), ("base", "General"), ("published", "leaves targets without data")]
    note = (
        "Across are the percent of a selection's trajectories that end in the goal configuration of their target's "
        "shortest candidate. Where it is far from 100, the same observation comes with different actions."
    )
    correlation = way_correlation(source.tests.summaries, source.results.coverage)
    if correlation:
        rank, n = correlation
        note += f" Rank correlation over the {n} selections that leave no target out: {rank:.2f}."
    return Figure("figure_ways", WAYS, note, [("", drawing)], legend)


def quality_marks(source: Source, name: str) -> list[Mark]:
    """A mark for each selection: a measure's mean, interval, the publication's, stars."""
    rows: list[QualityRow] = source.figure_rows(source.tests.quality)
    means: list[tuple[str, Mean]] = [(row.selector, getattr(row, name)) for row in rows]
    return [
        Mark(
            selector,
            mean.value,
            mean.interval.low,
            mean.interval.high,
            mean.published,
            text.plain_stars(mean.welch_test),
            selector == BASELINE,
        )
        for selector, mean in means
    ]
