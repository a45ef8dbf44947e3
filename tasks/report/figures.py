"""Figures 2 to 5 and A1 to A3 of the publication, and success over budgets; at the largest budget."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

from plancurate.tasks.report import text
from plancurate.tasks.report.charts import Mark, Panel, bars, forest, heat_map, small_curves
from plancurate.tasks.report.contents import Figure
from plancurate.tasks.report.published import published_results
from plancurate.tasks.report.rows import DistanceRow, Mean, PolicyRow, QualityRow, SuccessRow, TimeRow
from plancurate.tasks.report.source import Source
from plancurate.tasks.study.results import BASELINE

SUCCESS = "success, %"
MEASURES = {
    "final_distance": "final distance, m",
    "path_length": "path length, m",
    "joint_movement": "joint movement, rad",
}
OURS, GENERAL = ("ours", "this study"), ("base", "General: everything is kept")
INTERVAL, PUBLISHED = ("interval", "95 % interval"), ("published", "the publication")
GENERAL_LINE = ("base-line", "General")
LEGEND = (OURS, GENERAL, INTERVAL, PUBLISHED)
RowT = TypeVar("RowT", SuccessRow, PolicyRow, DistanceRow, QualityRow, TimeRow)


def success_bars(source: Source, rows: Sequence[SuccessRow]) -> Figure:
    """Figure 2: success by selector with Wilson intervals."""
    title = "Figure 2. Success by selector"
    drawing = bars(title, SUCCESS, _success_marks(source, rows), _one_decimal, 100)
    return Figure(
        "figure_2", title, f"{at_budget(source)} Stars: differs from General.", [(title, drawing)], LEGEND
    )


def success_forest(source: Source, rows: Sequence[SuccessRow]) -> Figure:
    """Figure A1: success against General's."""
    title = "Figure A1. Success against General"
    drawing = forest(title, SUCCESS, _success_marks(source, rows), _one_decimal, 100)
    return Figure("figure_a1", title, at_budget(source), [(title, drawing)], (*LEGEND, GENERAL_LINE))


def quality_bars(source: Source, rows: Sequence[QualityRow]) -> Figure:
    """Figure 3: final distance, path length and joint movement by selector."""
    title = "Figure 3. How the rollouts went"
    pictures = [
        (words, bars(f"{title}: {words}", words, _quality_marks(source, rows, name), text.decimals))
        for name, words in MEASURES.items()
    ]
    note = f"{at_budget(source)} Means over all tests."
    return Figure("figure_3", title, note, pictures, LEGEND)


def quality_forest(source: Source, rows: Sequence[QualityRow]) -> Figure:
    """Figure A2: the same against General's, on logarithmic scales."""
    title = "Figure A2. Rollouts against General"
    pictures = [
        (
            words,
            forest(
                f"{title}: {words}",
                f"{words} (logarithmic)",
                _quality_marks(source, rows, name),
                text.decimals,
                logarithmic=True,
            ),
        )
        for name, words in MEASURES.items()
    ]
    return Figure("figure_a2", title, at_budget(source), pictures, (*LEGEND, GENERAL_LINE))


def policy_map(source: Source, rows: Sequence[PolicyRow]) -> Figure:
    """Figure 4: success by selector and policy."""
    title = "Figure 4. Success by selector and policy"
    chosen = _largest(source, rows)
    policies = sorted({row.policy for row in chosen})
    shares = {(row.selector, row.policy): row.rate for row in chosen}
    drawing = heat_map(title, [name for name, _ in source.largest], policies, shares)
    return Figure("figure_4", title, f"In percent; darker is better. {at_budget(source)}", [(title, drawing)])


def distance_curves(source: Source, rows: Sequence[DistanceRow]) -> Figure:
    """Figure 5: success by distance of the tested from the trained target."""
    title = "Figure 5. Success by distance from the trained target"
    found = _largest(source, rows)
    distances = sorted({row.distance_cm for row in found})
    rates = {(row.selector, row.distance_cm): row.rate for row in found}

    def curve(name: str) -> list[float] | None:
        values = [rates.get((name, distance)) for distance in distances]
        return [value for value in values if value is not None] if None not in values else None

    panels = [
        Panel(name, ours, curve(BASELINE) if name != BASELINE else None, _published_curve(name, distances))
        for name, _ in source.largest
        for ours in [curve(name)]
        if ours is not None
    ]
    pictures = small_curves(title, "distance, cm", [str(distance) for distance in distances], panels)
    legend = (OURS, GENERAL_LINE, ("published-line", "the publication"))
    return Figure("figure_5", title, f"Success in percent. {at_budget(source)}", pictures, legend, small=True)


def time_forest(source: Source, rows: Sequence[TimeRow]) -> Figure:
    """Figure A3: selection time."""
    title = "Figure A3. Selection time"
    marks = [
        Mark(row.selector, row.total, published=row.published, base=row.selector == BASELINE)
        for row in _largest(source, rows)
    ]
    drawing = forest(title, "selection time, s (logarithmic)", marks, text.seconds, logarithmic=True)
    legend = (OURS, GENERAL, PUBLISHED, GENERAL_LINE)
    return Figure("figure_a3", title, f"{at_budget(source)} One run each.", [(title, drawing)], legend)


def budget_curves(source: Source, rows: Sequence[SuccessRow]) -> Figure | None:
    """Success over budgets, a picture for each selector; nothing for a single budget."""
    budgets = sorted({row.budget for row in rows if row.budget is not None})
    if len(budgets) < 2:
        return None
    title = "Success over budgets"
    rates = {(row.selector, row.budget): row.rate for row in rows}
    base = rates.get((BASELINE, None))
    panels = [
        Panel(
            name,
            [rates[name, number] for number in budgets],
            None if base is None else [base] * len(budgets),
        )
        for name, number in source.largest
        if number is not None and all((name, one) in rates for one in budgets)
    ]
    pictures = small_curves(title, "kept a target", [str(number) for number in budgets], panels)
    note = "Success in percent against the trajectories kept for each target."
    return Figure("figure_budgets", title, note, pictures, (OURS, GENERAL_LINE), small=True)


def at_budget(source: Source) -> str:
    """Which selections a figure shows; nothing where they are all that there are."""
    if source.largest == source.order:
        return ""
    return f"Selections of the largest budget, k = {max(number or 0 for _, number in source.largest)}."


def _largest(source: Source, rows: Sequence[RowT]) -> list[RowT]:
    return [row for row in rows if (row.selector, row.budget) in source.largest]


def _success_marks(source: Source, rows: Sequence[SuccessRow]) -> list[Mark]:
    return [
        Mark(
            row.selector,
            100 * row.rate,
            100 * row.wilson.low,
            100 * row.wilson.high,
            None if row.published is None else 100 * row.published,
            text.stars(row.against_general),
            row.selector == BASELINE,
        )
        for row in _largest(source, rows)
    ]


def _quality_marks(source: Source, rows: Sequence[QualityRow], name: str) -> list[Mark]:
    means: list[tuple[str, Mean]] = [(row.selector, getattr(row, name)) for row in _largest(source, rows)]
    return [
        Mark(
            selector,
            mean.value,
            mean.interval.low,
            mean.interval.high,
            mean.published,
            text.stars(mean.against_general),
            selector == BASELINE,
        )
        for selector, mean in means
    ]


def _published_curve(selector: str, distances: Sequence[int]) -> list[float] | None:
    found = published_results().get(selector)
    if found is None or not set(distances) <= set(found.by_distance):
        return None
    return [found.by_distance[distance].rate for distance in distances]


def _one_decimal(value: float) -> str:
    return f"{value:.1f}"
