"""Observation terms by name, and observations put together from them."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.registry import discover
from plancurate.tasks.learning.observations.state import FloatArray, State

if TYPE_CHECKING:
    from plancurate.robots.robot import Robot

ENTRY_POINTS = "plancurate.observations"
Observe = Callable[[State], FloatArray]
Layout = tuple[tuple[str, int], ...]
"""What an observation consists of: the name of each term and how many numbers it gives, in order."""


@dataclass(frozen=True)
class ObservationTerm:
    """A named part of what a policy sees."""

    name: str
    function: Observe
    """Gives (b, size) numbers for b states."""
    size: Callable[[Robot], int]
    """How many numbers it gives for a robot."""
    description: str
    revision: int
    """Raised by its author when it gives other numbers than before."""
    needs_goal: bool = False
    """Whether it reads `State.goal`: then trained policies keep what goals of tested positions are chosen by."""


_registry: dict[str, ObservationTerm] = {}


def observation_term(
    name: str, *, size: Callable[[Robot], int], revision: int = 1, needs_goal: bool = False
) -> Callable[[Observe], Observe]:
    """Register the decorated function as a term; the first line of its docstring describes it.

    `needs_goal` says that it reads `State.goal`, which is then never None. Raises ValueError when another function has
    the name.
    """

    def register(function: Observe) -> Observe:
        known = _registry.get(name)
        if known and known.function.__module__ != function.__module__:
            raise ValueError(
                f"observation term '{name}' is registered by {known.function.__module__} already"
            )
        description = (inspect.getdoc(function) or "").partition("\n")[0]
        _registry[name] = ObservationTerm(name, function, size, description, revision, needs_goal)
        return function

    return register


def find_term(name: str) -> ObservationTerm:
    """The term of that name; UnknownNameError otherwise."""
    _discover()
    if name not in _registry:
        raise UnknownNameError("observation term", name, _registry)
    return _registry[name]


def term_names() -> list[str]:
    """Names of all terms, sorted: those of this folder and those of installed entry points."""
    _discover()
    return sorted(_registry)


def require_terms(names: Sequence[str]) -> None:
    """Raise PlancurateError for a term that is unknown or named twice."""
    for k, name in enumerate(names):
        find_term(name)
        if name in names[:k]:
            raise PlancurateError(f"observation: term '{name}' is named twice; name it once")


def layout(names: Sequence[str], robot: Robot) -> Layout:
    """What an observation of these terms consists of for a robot."""
    return tuple((name, find_term(name).size(robot)) for name in names)


def goal_terms(names: Sequence[str]) -> list[str]:
    """Those of the terms that need a goal configuration."""
    return [name for name in names if find_term(name).needs_goal]


def width(parts: Layout) -> int:
    """How many numbers (o) an observation has."""
    return sum(size for _, size in parts)


def observe(names: Sequence[str], state: State) -> FloatArray:
    """Observations (b, o) of b states, the terms side by side in the order of their names.

    Raises PlancurateError for a term that gives another number of columns than it says, or needs a goal where none
    is known.
    """
    if state.goal is None and (needy := goal_terms(names)):
        raise PlancurateError(
            f"observation term '{needy[0]}' needs a goal configuration and there is none; give goals, or leave the "
            "term out"
        )
    parts = []
    for name, size in layout(names, state.robot):
        part = find_term(name).function(state)
        if part.shape != (len(state.q), size):
            raise PlancurateError(
                f"observation term '{name}' gives an array of shape {part.shape}, its size says {(len(state.q), size)}"
            )
        parts.append(part)
    return np.concatenate(parts, axis=1)


@cache
def _discover() -> None:
    discover("plancurate.tasks.learning.observations", ENTRY_POINTS)
