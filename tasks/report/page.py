"""The report as one HTML page that needs nothing else: no scripts, nothing to load."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from importlib.resources import files
from typing import Any

import yaml

from plancurate.tasks.report.contents import Figure, Report, Section, Table

REPEAT = "To repeat it"


def page(report: Report) -> str:
    """The whole page."""
    title = escape(f"Study {report.name}")
    sections = "\n".join(_section(section) for section in report.sections)
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>{title}</title>
<style>
{style_sheet()}</style>
</head>
<body>
<header>
<h1>{title}</h1>
{_paragraphs(report.summary)}
</header>
{_contents(report)}
<main>
{sections}
{_setup(report)}
</main>
</body>
</html>
"""


def style_sheet() -> str:
    """The page's CSS."""
    return files(__package__).joinpath("style.css").read_text(encoding="utf-8")


def _contents(report: Report) -> str:
    links = [(section.key, section.title) for section in report.sections] + [("repeat", REPEAT)]
    items = "".join(f'<li><a href="#{escape(key)}">{escape(title)}</a></li>' for key, title in links)
    return f'<nav aria-label="Contents">\n<h2>Contents</h2>\n<ol>{items}</ol>\n</nav>'


def _section(section: Section) -> str:
    parts = [*map(_figure, section.figures), *map(_table, section.tables)]
    text = _paragraphs([section.text] if section.text else [])
    heading = f'<h2 id="{escape(section.key)}">{escape(section.title)}</h2>'
    return "\n".join(["<section>", heading, text, *parts, "</section>"])


def _figure(figure: Figure) -> str:
    several = len(figure.pictures) > 1
    pictures = "\n".join(
        f'<div class="picture">{f"<p>{escape(caption)}</p>" if several else ""}{drawing.svg()}</div>'
        for caption, drawing in figure.pictures
    )
    legend = "".join(
        f'<li><span class="key {kind}"></span>{escape(words)}</li>' for kind, words in figure.legend
    )
    kind = "pictures small" if figure.small else "pictures"
    return f"""<figure id="{escape(figure.key)}">
<figcaption><h3>{escape(figure.title)}</h3>{_paragraphs([figure.note])}</figcaption>
{f'<ul class="legend">{legend}</ul>' if legend else ""}
<div class="{kind}">
{pictures}
</div>
</figure>"""


def _table(table: Table[Any]) -> str:
    head = "".join(f'<th scope="col">{_breakable(header)}</th>' for header in table.headers)
    lines = "\n".join(_line(cells) for cells in table.cells)
    commands = "\n".join(f"<pre><code>{escape(query.command)}</code></pre>" for query in table.queries)
    return f"""<div class="table" id="{escape(table.key)}">
<h3>{escape(table.title)}</h3>
{_paragraphs([table.note])}
<div class="scroll" tabindex="0" role="region" aria-label="{escape(table.title)}">
<table>
<thead><tr>{head}</tr></thead>
<tbody>
{lines}
</tbody>
</table>
</div>
<details><summary>These numbers from the lake</summary>
{commands}
</details>
</div>"""


def _line(cells: Iterable[str]) -> str:
    first, *others = cells
    return f'<tr><th scope="row">{escape(first)}</th>{"".join(f"<td>{escape(cell)}</td>" for cell in others)}</tr>'


def _breakable(header: str) -> str:
    return escape(header).replace("_", "_<wbr>")


def _setup(report: Report) -> str:
    lines = "\n".join(
        f"<dt>{escape(name.replace('_', ' '))}</dt><dd>{_value(value)}</dd>"
        for name, value in report.setup.items()
    )
    return f'<section>\n<h2 id="repeat">{REPEAT}</h2>\n<dl>\n{lines}\n</dl>\n</section>'


def _value(value: object) -> str:
    if isinstance(value, dict):
        return f"<pre><code>{escape(yaml.safe_dump(value, sort_keys=False))}</code></pre>"
    return escape(str(value))


def _paragraphs(texts: Iterable[str]) -> str:
    return "\n".join(f"<p>{escape(text)}</p>" for text in texts if text)
