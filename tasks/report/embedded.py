"""The report's figures as Markdown that holds its images itself, for pages that serve no files."""

from __future__ import annotations

import base64

from plancurate.tasks.report.contents import Report
from plancurate.tasks.report.page import style_sheet


def figures_markdown(report: Report) -> str:
    """Return every figure under its title."""
    style, lines = style_sheet(), []
    for figure in report.figures:
        lines.append(f"## {figure.title}")
        for caption, drawing in figure.pictures:
            image = base64.b64encode(drawing.svg(style).encode()).decode()
            lines.append(f"![{caption or figure.title}](data:image/svg+xml;base64,{image})")
    return "\n\n".join(lines)
