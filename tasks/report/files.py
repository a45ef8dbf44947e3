"""The files of a report: the page, the same tables as Markdown and JSON, the figures, the configuration."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import yaml

from plancurate.tasks.report.contents import Report
from plancurate.tasks.report.markdown import FIGURES, figure_file, markdown
from plancurate.tasks.report.page import page, style_sheet

PAGE = "index.html"


def write_report(report: Report, folder: Path) -> Path:
    """Write every file of the report into the folder; returns the page's path."""
    (folder / FIGURES).mkdir(parents=True, exist_ok=True)
    (folder / PAGE).write_text(page(report), encoding="utf-8")
    (folder / "report.md").write_text(markdown(report), encoding="utf-8")
    (folder / "report.json").write_text(as_json(report), encoding="utf-8")
    configuration = yaml.safe_dump(report.setup["configuration"], sort_keys=False)
    (folder / "config.yaml").write_text(configuration, encoding="utf-8")
    style = style_sheet()
    for figure in report.figures:
        for number, (_, drawing) in enumerate(figure.pictures):
            file = folder / FIGURES / figure_file(figure, number)
            file.write_text(drawing.svg(style), encoding="utf-8")
    return folder / PAGE


def as_json(report: Report) -> str:
    """The report's tables and setup as JSON; an unbounded end of an interval is null."""
    record = {
        "study": report.name,
        "verdict": list(report.verdict),
        "overview": report.overview,
        "tables": [table.record() for table in report.tables],
        "setup": report.setup,
    }
    return json.dumps(finite(record), indent=1, allow_nan=False)


def finite(value: Any) -> Any:
    """The value with None for every number that JSON does not have."""
    if isinstance(value, dict):
        return {name: finite(inner) for name, inner in value.items()}
    if isinstance(value, list | tuple):
        return [finite(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
