"""The report as one HTML page that needs nothing else: no scripts, nothing to load."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import Any

import yaml
from jinja2 import Environment, StrictUndefined, Template

from plancurate.tasks.report.contents import Report


def page(report: Report) -> str:
    """The whole page."""
    return _template().render(report=report, style=style_sheet()) + "\n"


def style_sheet() -> str:
    """The page's CSS."""
    return _text("style.css")


@cache
def _template() -> Template:
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters["yaml"] = _as_yaml
    return environment.from_string(_text("page.html.jinja"))


def _as_yaml(value: dict[str, Any]) -> str:
    return yaml.safe_dump(value, sort_keys=False)


def _text(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")
