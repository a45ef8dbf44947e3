"""Read a YAML file into a pydantic model; a mistake becomes one line that names file, field and value."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TypeVar

import yaml
from pydantic import BaseModel, ValidationError

from plancurate.errors import PlancurateError

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")  # of robots and scenes, which become folders of the lake

Model = TypeVar("Model", bound=BaseModel)


def read_yaml(file: Path, model: type[Model]) -> Model:
    """Validate `file` as `model`; raise PlancurateError for an unreadable file or a wrong field."""
    try:
        content = yaml.safe_load(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise PlancurateError(f"{file}: cannot be read: {error.strerror}") from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise PlancurateError(f"{file}: not valid YAML: {' '.join(str(error).split())}") from None
    try:
        return model.model_validate(content)
    except ValidationError as error:
        raise PlancurateError(f"{file}: {_first_mistake(error)}") from None


def _first_mistake(error: ValidationError) -> str:
    mistake = error.errors()[0]
    field = ".".join(str(part) for part in mistake["loc"]) or "content"
    given = "" if mistake["type"] == "missing" else f" (given: {mistake['input']!r})"
    return f"{field}: {mistake['msg']}{given}"
