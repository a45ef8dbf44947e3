"""Errors that a user can mend: one line that names the file, field and value, and what would be right."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

if TYPE_CHECKING:
    from pydantic import BaseModel, ValidationError

LONGEST_VALUE = 60  # characters of a wrong value that are shown


class PlancurateError(Exception):
    """A mistake in what was asked, not in the program; the command line prints its one line and exits with 2."""


class IncompleteError(RuntimeError):
    """Task runs failed; what the others made is in the lake, and the same command goes on from there."""


class UnknownNameError(PlancurateError):
    """A robot, scene, planner, selector, policy or parameter that is not registered."""

    def __init__(self, kind: str, name: str, valid: Iterable[str]) -> None:
        names = sorted(valid)
        near = difflib.get_close_matches(name, names, n=3, cutoff=0.4)
        hint = f"did you mean {' or '.join(near)}? " if near else ""
        choice = f"valid are {', '.join(names)}" if names else "there is none yet"
        super().__init__(f"unknown {kind} '{name}': {hint}{choice}")
        self.kind, self.name, self.valid = kind, name, tuple(names)

    def __reduce__(self) -> tuple[type, tuple[str, str, tuple[str, ...]]]:
        """Pickle by the arguments: the error crosses process boundaries."""
        return (type(self), (self.kind, self.name, self.valid))


def shown(url: str) -> str:
    """Return an address as it may be shown: without its user, password and query."""
    parts = urlsplit(url)
    return parts._replace(netloc=parts.netloc.rpartition("@")[2], query="").geturl()


def field_of(error: ValidationError) -> str:
    """Return the dotted name of the field that pydantic found wrong first."""
    return ".".join(str(part) for part in error.errors(include_url=False)[0]["loc"]) or "content"


def first_problem(where: object, error: ValidationError, model: type[BaseModel]) -> str:
    """Say in one line what pydantic found wrong first: where, the value, and what would be right."""
    problem = error.errors(include_url=False)[0]
    *parents, name = problem["loc"] or ("content",)
    if problem["type"] == "extra_forbidden" and (valid := field_names(model, parents)):
        return f"{where}: {UnknownNameError('field', str(name), valid)}"
    wrong = "" if problem["type"] == "missing" else f" = {shortened(problem['input'])}"
    return f"{where}{wrong}: {problem['msg'].removeprefix('Value error, ')}"


def field_names(model: Any, parents: Iterable[str | int]) -> list[str]:
    """Return the names of the fields that a model has below a field of its own; none where it is no model."""
    for parent in parents:
        field = getattr(model, "model_fields", {}).get(parent)
        model = field.annotation if field else None
    return list(getattr(model, "model_fields", {}))


def shortened(value: object) -> str:
    """Return a value as Python writes it, cut where it gets long."""
    text = repr(value)
    return text if len(text) <= LONGEST_VALUE else f"{text[:LONGEST_VALUE]}..."
