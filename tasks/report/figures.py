"""Figures 2, 4, 5 and A1 of the publication, about success, and success over budgets and scenes."""

from __future__ import annotations

from collections.abc import Sequence

from plancurate.tasks.report.charts import (
    Mark,
    Panel,
    bars,
    forest,
    heat_map,
    small_curves,
)
from plancurate.tasks.report.contents import Figure
from plancurate.tasks.report.source import FRESH_TITLES, Source
from plancurate.tasks.study.against import BASELINE
from plancurate.tasks.study.published import published_for
from plancurate.tasks.study.rows import ALL_SCENES, DistanceRow

SUCCESS = "success, %"
OURS, GENERAL = ("ours", "this study"), ("base", "General: everything is kept")
INTERVAL, PUBLISHED = ("interval", "95 % interval"), ("published", "the publication")
GENERAL_LINE, PUBLISHED_LINE = ("base-line", "General"), ("published-line", "the publication")
LEGEND = (OURS, GENERAL, INTERVAL, PUBLISHED)


def success_bars(source: Source) -> Figure:
    """Figure 2: success by selector."""
    title = "Figure 2. Success by selector"
    note = f"{source.figure_note(source.tests.summaries)} Stars: differs from General."
    return Figure(
        "figure_2",
        title,
        note,
        [(title, bars(title, SUCCESS, success_marks(source), _one_decimal, 100))],
        LEGEND,
    )


def success_forest(source: Source) -> Figure:
    """Figure A1: success against General's."""
    title = "Figure A1. Success against General"
    drawing = forest(title, SUCCESS, success_marks(source), _one_decimal, 100)
    note = source.figure_note(source.tests.summaries)
    return Figure("figure_a1", title, note, [(title, drawing)], (*LEGEND, GENERAL_LINE))


def fresh_bars(source: Source) -> Figure:
    """Success by selector at fresh targets."""
    title = FRESH_TITLES[source.kind]
    drawing = bars(title, SUCCESS, success_marks(source), _one_decimal, 100)
    note = f"{source.figure_note(source.tests.summaries)} Stars: differs from General."
    return Figure(f"figure_{source.kind}", title, note, [(title, drawing)], (OURS, GENERAL, INTERVAL))


def scene_map(source: Source) -> Figure | None:
    """Success by selector and scene; nothing for a single scene."""
    if len(source.groups) < 2:
        return None
    title = f"Success by selector and scene, {source.kind} targets"
    rows = source.tests.summaries
    names = list(dict.fromkeys(row.name for row in rows))
    columns = list(
        dict.fromkeys(row.group_title for row in sorted(rows, key=lambda row: row.scene == ALL_SCENES))
    )
    shares = {(row.name, row.group_title): row.success_rate for row in rows}
    drawing = heat_map(title, names, columns, shares)
    return Figure(f"figure_scenes_{source.kind}", title, "In percent; darker is better.", [(title, drawing)])


def policy_map(source: Source) -> Figure:
    """Figure 4: success by selector and policy."""
    title = "Figure 4. Success by selector and policy"
    rows = source.figure_rows(source.tests.policies)
    policies = sorted({row.policy for row in rows})
    shares = {(row.selector, row.policy): row.success_rate for row in rows}
    drawing = heat_map(title, list(dict.fromkeys(row.selector for row in rows)), policies, shares)
    note = f"In percent; darker is better. {source.figure_note(source.tests.policies)}"
    return Figure("figure_4", title, note, [(title, drawing)])


def distance_curves(source: Source) -> Figure:
    """Figure 5: success by distance of the tested from the trained target."""
    title = "Figure 5. Success by distance from the trained target"
    rows = source.figure_rows(source.tests.distances)
    distances = sorted({row.distance_cm for row in rows})
    curves = _curves(rows)
    panels = [
        Panel(
            name,
            [curve[distance] for distance in distances],
            [curves[BASELINE][distance] for distance in distances]
            if name != BASELINE and BASELINE in curves
            else None,
            _published_curve(name, distances),
        )
        for name, curve in curves.items()
        if set(curve) == set(distances)
    ]
    pictures = small_curves(title, "distance, cm", [str(distance) for distance in distances], panels)
    note = f"Success in percent. {source.figure_note(source.tests.distances)}"
    return Figure("figure_5", title, note, pictures, (OURS, GENERAL_LINE, PUBLISHED_LINE), small=True)


def budget_curves(source: Source) -> Figure | None:
    """Success over budgets, a picture for each selector; nothing for a single budget."""
    rows = [row for row in source.tests.summaries if row.group == source.groups[0]]
    budgets = sorted({row.budget for row in rows if row.budget is not None})
    if len(budgets) < 2:
        return None
    title = "Success over budgets"
    rates = {(row.selector, row.budget): row.success_rate for row in rows}
    base = rates.get((BASELINE, None))
    panels = [
        Panel(name, [rates[name, k] for k in budgets], None if base is None else [base] * len(budgets))
        for name in dict.fromkeys(row.selector for row in rows)
        if all((name, k) in rates for k in budgets)
    ]
    pictures = small_curves(title, "kept a target", [str(number) for number in budgets], panels)
    note = "Success in percent against the trajectories kept for each target."
    return Figure("figure_budgets", title, note, pictures, (OURS, GENERAL_LINE), small=True)


def success_marks(source: Source) -> list[Mark]:
    """A mark for each selection: success, interval, the publication's, stars."""
    return [
        Mark(
            row.selector,
            100 * row.success_rate,
            100 * row.interval.low,
            100 * row.interval.high,
            None if row.published is None else 100 * row.published,
            row.gain.stars if row.gain else "",
            row.selector == BASELINE,
        )
        for row in source.figure_rows(source.tests.summaries)
    ]


def _curves(rows: Sequence[DistanceRow]) -> dict[str, dict[int, float]]:
    curves: dict[str, dict[int, float]] = {}
    for row in rows:
        curves.setdefault(row.selector, {})[row.distance_cm] = row.success_rate
    return curves


def _published_curve(selector: str, distances: Sequence[int]) -> list[float] | None:
    known = published_for([selector]).get(selector)
    if known is None or not set(distances) <= set(known.by_distance):
        return None
    return [known.by_distance[distance].rate for distance in distances]


def _one_decimal(value: float) -> str:
    return f"{value:.1f}"
