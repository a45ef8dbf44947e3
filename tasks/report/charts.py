"""Kinds of charts: bars, forest plots, heat maps and small curves, from plain values."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from textwrap import wrap

from plancurate.tasks.report.svg import CHARACTER, Drawing, Scale, decades, label_width, linear

WIDTH = 420.0  # of a chart with a row for each selection; a phone shows it at about nine tenths
ROW = 22.0
TOP, BOTTOM, MARGIN = 8.0, 40.0, 10.0
VALUE_WIDTH = 80.0  # of the columns of numbers and stars at the right
STARS_WIDTH = 26.0
PANEL_WIDTH, PANEL_HEIGHT = 180.0, 150.0
CELL = 50.0
LINE = 13.0  # of a column's head
# From pale to dark blue, by lightness in even steps: the order is seen without telling colours apart.
HEAT = ("#eef4fa", "#d2e3f1", "#aecde5", "#82b3d7", "#5796c6", "#3379b1", "#195d97", "#0a4178")

PLOT_HEIGHT = 280.0

Format = Callable[[float], str]


@dataclass(frozen=True)
class Mark:
    """One row of a chart: a value with its interval, and what the publication found."""

    label: str
    value: float
    low: float | None = None
    high: float | None = None
    published: float | None = None
    note: str = ""
    base: bool = False
    """Whether this is the baseline that the others are compared with."""


@dataclass(frozen=True)
class Panel:
    """One of many small curves: our values, the baseline's and the publication's at the same places."""

    label: str
    values: Sequence[float]
    base: Sequence[float] | None = None
    published: Sequence[float] | None = None


@dataclass(frozen=True)
class Point:
    """Two shares (0 to 1) and the style sheet's class of the point."""

    across: float
    up: float
    kind: str


def scatter(title: str, across_axis: str, up_axis: str, points: Sequence[Point]) -> Drawing:
    """Points by two shares, both as percent."""
    drawing = Drawing(WIDTH, PLOT_HEIGHT, title)
    across, up = Scale(0.0, 1.0, 44, WIDTH - 14), Scale(0.0, 1.0, PLOT_HEIGHT - BOTTOM, 24)
    for share in (0.0, 0.2, 0.4, 0.6, 0.8, 1.0):
        drawing.line(across.start, up(share), across.end, up(share), "grid")
        drawing.line(across(share), up.start, across(share), up.end, "grid")
        drawing.text(across.start - 6, up(share) + 4, f"{100 * share:.0f}", "tick", "end")
        drawing.text(across(share), up.start + 16, f"{100 * share:.0f}", "tick", "middle")
    drawing.text((across.start + across.end) / 2, PLOT_HEIGHT - 6, across_axis, "tick", "middle")
    drawing.text(4, 12, up_axis, "tick")
    for point in points:
        draw = drawing.diamond if point.kind == "published" else drawing.dot
        draw(across(point.across), up(point.up), 5, point.kind)
    return drawing


def bars(title: str, axis: str, marks: Sequence[Mark], text: Format, limit: float | None = None) -> Drawing:
    """A bar from 0 for each mark, its interval on it and the published value as a diamond."""
    return _rows(title, axis, marks, text, _scale(marks, limit, logarithmic=False), filled=True)


def forest(
    title: str,
    axis: str,
    marks: Sequence[Mark],
    text: Format,
    limit: float | None = None,
    *,
    logarithmic: bool = False,
) -> Drawing:
    """A point with its interval for each mark, and a dashed line through the baseline's value."""
    return _rows(title, axis, marks, text, _scale(marks, limit, logarithmic), filled=False)


def broken(name: str, letters: int) -> list[str]:
    """A name in lines of at most so many letters, broken at spaces and after underscores and hyphens."""
    lines = wrap(name.replace("_", "_ ").replace("-", "- "), letters)
    return [line.replace("_ ", "_").replace("- ", "-") for line in lines]


def heat_map(
    title: str, rows: Sequence[str], columns: Sequence[str], shares: Mapping[tuple[str, str], float]
) -> Drawing:
    """Shares (0 to 1) of each row and column as shaded cells with the percentage in them."""
    left = label_width(rows)
    width = max(CELL, (WIDTH - left - MARGIN) / len(columns))
    heads = [broken(column, max(8, int(width / CHARACTER))) for column in columns]
    top = 8.0 + LINE * max(map(len, heads))
    drawing = Drawing(left + width * len(columns) + MARGIN, top + ROW * len(rows) + MARGIN, title)
    for j, head in enumerate(heads):
        for k, part in enumerate(head):
            drawing.text(left + width * (j + 0.5), 14 + LINE * k, part, anchor="middle")
    for i, row in enumerate(rows):
        y = top + ROW * i
        drawing.text(left - 6, y + 15, row, anchor="end")
        for j, column in enumerate(columns):
            share = shares.get((row, column))
            if share is None:
                continue
            shade = min(int(share * len(HEAT)), len(HEAT) - 1)
            drawing.box(left + width * j + 1, y + 1, width - 2, ROW - 2, "cell", HEAT[shade])
            ink = "on-dark" if shade >= len(HEAT) // 2 else "on-light"
            drawing.text(left + width * (j + 0.5), y + 15, f"{100 * share:.1f}", ink, "middle")
    return drawing


def small_curves(
    title: str, axis: str, places: Sequence[str], panels: Sequence[Panel]
) -> list[tuple[str, Drawing]]:
    """A picture for each panel: shares (0 to 1) as percent over places, all on the same scale."""
    return [(panel.label, _curve(f"{title}: {panel.label}", axis, places, panel)) for panel in panels]


def _scale(marks: Sequence[Mark], limit: float | None, logarithmic: bool) -> Scale:
    start, end = label_width([mark.label for mark in marks]), WIDTH - VALUE_WIDTH
    values = [v for mark in marks for v in (mark.value, mark.low, mark.high, mark.published) if v is not None]
    if logarithmic:
        return decades(values, start, end)
    return linear(values, start, end) if limit is None else Scale(0.0, limit, start, end)


def _rows(
    title: str, axis: str, marks: Sequence[Mark], text: Format, scale: Scale, *, filled: bool
) -> Drawing:
    foot = TOP + ROW * len(marks)
    drawing = Drawing(WIDTH, foot + BOTTOM, title)
    for tick in scale.ticks():
        drawing.line(scale(tick), TOP, scale(tick), foot, "grid")
        drawing.text(scale(tick), foot + 16, f"{tick:g}", "tick", "middle")
    drawing.text((scale.start + scale.end) / 2, foot + 33, axis, "tick", "middle")
    base = next((mark for mark in marks if mark.base), None)
    if base is not None and not filled:
        drawing.line(scale(base.value), TOP, scale(base.value), foot, "base-line")
    for i, mark in enumerate(marks):
        _row(drawing, scale, TOP + ROW * (i + 0.5), mark, text, filled)
    return drawing


def _row(drawing: Drawing, scale: Scale, y: float, mark: Mark, text: Format, filled: bool) -> None:
    kind = "base" if mark.base else "ours"
    drawing.text(scale.start - 8, y + 4, mark.label, anchor="end")
    if filled:
        drawing.box(scale.start, y - 7, scale(mark.value) - scale.start, 14, kind)
    if mark.low is not None and mark.high is not None:
        low, high = scale(mark.low), scale(mark.high)
        drawing.line(low, y, high, y, "interval")
        for end in (low, high):
            drawing.line(end, y - 3, end, y + 3, "interval")
    if not filled:
        drawing.dot(scale(mark.value), y, 4.5, kind)
    if mark.published is not None:
        drawing.diamond(scale(mark.published), y, 4.5, "published")
    drawing.text(WIDTH - STARS_WIDTH, y + 4, text(mark.value), anchor="end")
    drawing.text(WIDTH - STARS_WIDTH + 4, y + 4, mark.note)


def _curve(title: str, axis: str, places: Sequence[str], panel: Panel) -> Drawing:
    drawing = Drawing(PANEL_WIDTH, PANEL_HEIGHT, title)
    across = Scale(0, max(len(places) - 1, 1), 34, PANEL_WIDTH - 10)
    up = Scale(0.0, 1.0, PANEL_HEIGHT - 34, 12)
    for share in (0.0, 0.5, 1.0):
        drawing.line(across.start, up(share), across.end, up(share), "grid")
        drawing.text(across.start - 5, up(share) + 4, f"{100 * share:.0f}", "tick", "end")
    for i, place in enumerate(places):
        drawing.text(across(i), up.start + 15, place, "tick", "middle")
    drawing.text((across.start + across.end) / 2, PANEL_HEIGHT - 4, axis, "tick", "middle")
    for values, kind in (
        (panel.base, "base-line"),
        (panel.published, "published-line"),
        (panel.values, "curve"),
    ):
        if values is not None:
            drawing.curve([(across(i), up(value)) for i, value in enumerate(values)], kind)
    for i, value in enumerate(panel.values):
        drawing.dot(across(i), up(value), 2.5, "ours")
    return drawing
