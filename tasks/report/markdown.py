"""The report as Markdown, with the same tables as the page and links to the figures' files."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import yaml

from plancurate.tasks.report.contents import Figure, Report, Table

CODE = re.compile(r"(`[^`|]*`)")
SIGNS = re.compile(r"[\\|*_\[\]<]")
FIGURES = "figures"
"""Folder of the figures' files, beside report.md."""


def markdown(report: Report, *, figures: bool = True) -> str:
    """The whole report; without figures where there is no folder to link to."""
    verdict = "\n".join(f"- {_escaped(sentence)}" for sentence in report.verdict)
    parts = [f"# Study {report.name}", verdict, _escaped(report.overview)]
    for section in report.sections:
        parts += [f"## {section.title}", _escaped(section.text)]
        if figures:
            parts += [_figure(figure) for figure in section.figures]
        parts += [_table(table) for table in section.tables]
    parts += ["## To repeat it", f"```yaml\n{yaml.safe_dump(dict(report.setup), sort_keys=False)}```"]
    return "\n\n".join(part for part in parts if part) + "\n"


def figure_file(figure: Figure, number: int) -> str:
    """Name of the file of a figure's picture `number`."""
    return f"{figure.key}.svg" if len(figure.pictures) == 1 else f"{figure.key}_{number + 1}.svg"


def _figure(figure: Figure) -> str:
    links = [
        f"![{_escaped(caption)}]({FIGURES}/{figure_file(figure, number)})"
        for number, (caption, _) in enumerate(figure.pictures)
    ]
    return "\n\n".join([f"### {_escaped(figure.title)}", _escaped(figure.note), "\n".join(links)])


def _table(table: Table[Any]) -> str:
    lines = [_line(table.headers), "|" + " --- |" * len(table.headers), *map(_line, table.cells)]
    commands = "\n".join(query.command for query in table.queries)
    return "\n\n".join(
        [f"### {_escaped(table.title)}", _escaped(table.note), "\n".join(lines), f"```sh\n{commands}\n```"]
    )


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(_escaped(cell) for cell in cells) + " |"


def _escaped(text: str) -> str:
    """Return text as it is to be read; what stands between back quotes is read as it is anyway."""
    parts = CODE.split(text)
    return "".join(part if CODE.fullmatch(part) else SIGNS.sub(r"\\\g<0>", part) for part in parts)
