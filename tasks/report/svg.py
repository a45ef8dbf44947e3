"""Drawing: an SVG picture put together from a few shapes, and the scales that place values on it.

Shapes carry CSS classes, no colours: the page's style sheet gives them theirs, for light and dark.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence
from dataclasses import dataclass
from xml.sax.saxutils import escape, quoteattr

CHARACTER = 7.2  # width of a letter of the picture's text on average, in the picture's units
LINE = 14  # height of a line of that text


class Drawing:
    """A picture of some width and height in units of its own; it grows and shrinks with the page."""

    def __init__(self, width: float, height: float, title: str) -> None:
        self.width, self.height, self.title = width, height, title
        self._shapes: list[str] = []

    def line(self, x1: float, y1: float, x2: float, y2: float, kind: str) -> None:
        """Draw a straight line."""
        self._shapes.append(f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" class="{kind}"/>')

    def box(self, x: float, y: float, width: float, height: float, kind: str, fill: str = "") -> None:
        """Draw a rectangle; `fill` is a colour where the class does not decide it."""
        colour = f' fill="{fill}"' if fill else ""
        size = f'width="{max(width, 0):.1f}" height="{height:.1f}"'
        self._shapes.append(f'<rect x="{x:.1f}" y="{y:.1f}" {size} class="{kind}"{colour}/>')

    def dot(self, x: float, y: float, radius: float, kind: str) -> None:
        """Draw a circle."""
        self._shapes.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}" class="{kind}"/>')

    def diamond(self, x: float, y: float, radius: float, kind: str) -> None:
        """Draw a square that stands on a corner."""
        corners = [(x, y - radius), (x + radius, y), (x, y + radius), (x - radius, y)]
        self._shapes.append(f'<polygon points="{_points(corners)}" class="{kind}"/>')

    def curve(self, points: Sequence[tuple[float, float]], kind: str) -> None:
        """Join points by straight lines."""
        self._shapes.append(f'<polyline points="{_points(points)}" class="{kind}"/>')

    def image(self, width: float, height: float, png: bytes) -> None:
        """Fill the picture with a PNG, which it holds itself."""
        data = base64.b64encode(png).decode()
        size = f'width="{width:.0f}" height="{height:.0f}"'
        self._shapes.append(f'<image {size} href="data:image/png;base64,{data}"/>')

    def text(self, x: float, y: float, words: str, kind: str = "", anchor: str = "start") -> None:
        """Write words with their base line at y; anchor: start, middle or end."""
        self._shapes.append(
            f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" class="{kind}">{escape(words)}</text>'
        )

    def svg(self, style: str = "") -> str:
        """The picture as an SVG element; `style` makes it stand without the page."""
        inner = f"<style>{style}</style>" if style else ""
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self.width:.0f} {self.height:.0f}" '
            f'role="img" aria-label={quoteattr(self.title)}>{inner}<title>{escape(self.title)}</title>'
            f"{''.join(self._shapes)}</svg>"
        )


@dataclass(frozen=True)
class Scale:
    """Places values from `low` to `high` between the positions `start` and `end`."""

    low: float
    high: float
    start: float
    end: float
    logarithmic: bool = False

    def __call__(self, value: float) -> float:
        """Position of a value; values outside (an unbounded interval's ends too) stop at the edge."""
        low, high, value = (self._level(v) for v in (self.low, self.high, value))
        share = min(max((value - low) / (high - low), 0.0), 1.0)
        return self.start + share * (self.end - self.start)

    def ticks(self) -> list[float]:
        """Round values to label: about five, or every power of ten."""
        if self.logarithmic:
            first, last = math.ceil(math.log10(self.low) - 1e-9), math.floor(math.log10(self.high) + 1e-9)
            stride = 1 + (last - first) // 6
            return [10.0**power for power in range(first, last + 1, stride)]
        step = round_step((self.high - self.low) / 5)
        return [
            step * i
            for i in range(math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9) + 1)
        ]

    def _level(self, value: float) -> float:
        if not self.logarithmic:
            return value
        return math.log10(value) if value > 0 else -math.inf


def linear(values: Sequence[float], start: float, end: float) -> Scale:
    """A scale from 0 to just above the largest finite value."""
    highest = max((value for value in values if math.isfinite(value)), default=0.0) or 1.0
    step = round_step(highest / 5)
    return Scale(0.0, step * math.ceil(highest / step - 1e-9), start, end)


def decades(values: Sequence[float], start: float, end: float) -> Scale:
    """A logarithmic scale over whole powers of ten around the positive values."""
    known = [value for value in values if 0 < value < math.inf] or [1.0]
    low, high = math.floor(math.log10(min(known))), math.ceil(math.log10(max(known)))
    return Scale(10.0**low, 10.0 ** max(high, low + 1), start, end, logarithmic=True)


def round_step(step: float) -> float:
    """The nearest 1, 2 or 5 times a power of ten that is not below the step."""
    power = 10.0 ** math.floor(math.log10(step))
    return next(factor * power for factor in (1, 2, 5, 10) if factor * power >= step * (1 - 1e-9))


def label_width(labels: Sequence[str]) -> float:
    """Room that the longest label takes."""
    return CHARACTER * max(map(len, labels), default=0) + 8


def _points(points: Sequence[tuple[float, float]]) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
