"""Options of the commands that run a study: the fields of its configuration, as the model has them.

cyclopts finds names, help and nesting in the model, and hands over what was given as text; nothing is converted
before preset, file and options lie over each other. So a default never counts as given, a new field is an
option by itself, and every mistake is reported by the model.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_origin

from cyclopts import Group, Parameter
from pydantic import BaseModel, Field, PlainValidator, create_model
from pydantic.fields import FieldInfo

from plancurate.flows.cli.options import HomeOptions
from plancurate.tasks.study.config import StudyConfig, load_config

# Spellings beside the fields' own.
ALIASES = {"n_targets": "--targets", "scenes": "--scene"}
GROUP = Group(
    "Fields of the study",
    help="Each over the preset's and the file's. `plancurate fields` lists the others, such as "
    "--candidates.plan.runs.",
)


def as_option(name: str, field: FieldInfo) -> tuple[Any, Any]:
    """Return a field as cyclopts is to see it; settings, whose fields are many, are not in the help."""
    option = Parameter(alias=ALIASES.get(name), show=not is_model(field.annotation))
    return Annotated[plain(field.annotation) | None, option], Field(None, description=field.description)


def plain(kind: Any) -> Any:
    """Return a type that cyclopts can spell: plain keys and text stand for what only the model can read."""
    if is_model(kind) or get_origin(kind) is dict:
        return dict[str, Any]
    if get_origin(kind) is tuple:
        element = get_args(kind)[0]
        return tuple[str, ...] if is_model(get_args(element)[0] if get_args(element) else element) else kind
    return kind


def is_model(kind: Any) -> bool:
    """Say whether a type is a pydantic model."""
    return isinstance(kind, type) and issubclass(kind, BaseModel)


def given(options: dict[str, Any]) -> dict[str, Any]:
    """Return the fields that were given, by the names and values that the model knows."""
    models = {name for name, field in StudyConfig.model_fields.items() if is_model(field.annotation)}
    return {name: as_field(value, settings=name in models) for name, value in options.items()}


def as_field(value: Any, *, settings: bool) -> Any:
    """Return an option's value: `null` is None, JSON is what it says; fields of settings have `_` for `-`."""
    if isinstance(value, Mapping):
        names = {name: name.replace("-", "_") if settings else name for name in value}
        return {names[name]: as_field(inner, settings=settings) for name, inner in value.items()}
    if isinstance(value, list):
        values = [as_field(inner, settings=False) for inner in value]
        return values[0] if len(values) == 1 and isinstance(values[0], list) else values
    if isinstance(value, str) and value.startswith(("{", "[")):
        return json.loads(value)
    return None if value == "null" else value


if TYPE_CHECKING:
    Fields = dict[str, Any]
else:
    _fields = {name: as_option(name, field) for name, field in StudyConfig.model_fields.items()}
    Fields = Annotated[
        create_model("Fields", **_fields),
        Parameter(name="*", group=GROUP, show_default=False, consume_multiple=1, negative_iterable=()),
        PlainValidator(given),  # in place of the model's own, which would ask for a whole configuration
    ]


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class StudyOptions(HomeOptions):
    """What to study: a preset, then a file, then single options, each over the one before."""

    preset: str = "quick"
    """smoke (a minute), quick (two minutes), paper or paper_moveit (the publication's size, an hour)."""
    config: Path | None = None
    """YAML file with fields that differ from the preset."""
    fields: Fields = field(default_factory=dict)

    def study(self) -> StudyConfig:
        """Build the configuration; raises PlancurateError naming the option or field that is wrong."""
        return load_config(self.preset, self.config, self.fields)
