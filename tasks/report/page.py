"""The report as one HTML page that needs nothing else: no scripts, nothing to load."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import Any

import yaml
from jinja2 import Environment, StrictUndefined, Template
from markupsafe import Markup

from plancurate.tasks.report.contents import Report
from plancurate.tasks.report.markdown import CODE


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
    environment.filters["words"] = _words
    return environment.from_string(_text("page.html.jinja"))


def _words(text: str) -> Markup:
    """A sentence; what stands between back quotes is code."""
    parts = [
        Markup("<code>{}</code>").format(part[1:-1]) if CODE.fullmatch(part) else part
        for part in CODE.split(text)
    ]
    return Markup("").join(parts)


def _as_yaml(value: dict[str, Any]) -> str:
    return yaml.safe_dump(value, sort_keys=False)


def _text(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")
