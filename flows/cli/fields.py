"""The command that lists the fields of a study."""

from __future__ import annotations

import json
from collections.abc import Iterator

from pydantic import BaseModel
from rich.padding import Padding
from rich.text import Text

from plancurate.flows.cli.console import output
from plancurate.tasks.curation.selector_choice import SelectorChoice
from plancurate.tasks.study.config import StudyConfig

LONGEST_DEFAULT = 60  # characters


def fields() -> None:
    """List every field of a study with its default: for a --config file, and as an option with -- before it."""
    for name, default, description in leaves(StudyConfig()):
        output.print(Text.assemble((name, "bold"), f" = {default_text(default)}"))
        output.print(Padding(Text(description, "dim"), (0, 0, 0, 4)))


def leaves(settings: BaseModel, prefix: str = "") -> Iterator[tuple[str, object, str]]:
    """Yield dotted name, default and description of all that can be set, settings within settings included."""
    for name, field in type(settings).model_fields.items():
        value = getattr(settings, name)
        if isinstance(value, BaseModel):
            yield from leaves(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value, field.description or ""


def default_text(value: object) -> str:
    """Return a default as YAML has it, cut where it gets long."""
    if isinstance(value, tuple):
        text = f"[{', '.join(map(default_text, value))}]"
    elif isinstance(value, SelectorChoice):
        text = value.label
    else:
        text = value if isinstance(value, str) else json.dumps(value)
    return text if len(text) <= LONGEST_DEFAULT else f"{text[:LONGEST_DEFAULT]}..."
