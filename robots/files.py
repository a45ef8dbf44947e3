"""Read a YAML file into a pydantic model; a mistake becomes one line that names file, field and value."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from plancurate import yaml_files
from plancurate.errors import PlancurateError, field_of, first_problem

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")  # of robots and scenes, which become folders of the lake

Model = TypeVar("Model", bound=BaseModel)


def read_yaml(file: Path, model: type[Model]) -> Model:
    """Validate `file` as `model`; raise PlancurateError for an unreadable file or a wrong field."""
    try:
        return model.model_validate(yaml_files.read_yaml(file))
    except ValidationError as error:
        raise PlancurateError(first_problem(f"{file}: {field_of(error)}", error, model)) from None
