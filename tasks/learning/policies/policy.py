"""What every policy network offers, and the register of networks by name."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, ClassVar, TypeVar

import torch
from pydantic import ValidationError
from torch import Tensor

from plancurate.bounds import Settings
from plancurate.errors import PlancurateError, UnknownNameError, field_of, first_problem
from plancurate.registry import discover

ENTRY_POINTS = "plancurate.policies"
Weights = Mapping[str, Tensor]
"""Parameters by name; in a stack of S networks each tensor has a leading dimension S."""


class Policy(Settings, ABC):
    """A network's settings and its mathematics, for S stacked networks at once.

    A policy holds no parameters: they are passed in, stacked, so that a loss or a step of S networks is one
    batched matrix product. Everything is in standardised units.
    """

    name: ClassVar[str]
    revision: ClassVar[int] = 1
    """Raised by the policy's author when it learns or acts otherwise than before."""
    recurrent: ClassVar[bool]
    """Whether it learns from windows and remembers the steps before."""
    robomimic: ClassVar[Mapping[str, Any]] = {}
    """Settings that give it the size that robomimic's published experiments use."""

    batch: int

    @abstractmethod
    def initial(self, observed: int, acted: int, rng: torch.Generator) -> dict[str, Tensor]:
        """Draw the first parameters of one network, without dimension S, for so many inputs and outputs."""

    @abstractmethod
    def loss(self, weights: Weights, observations: Tensor, actions: Tensor, masks: Tensor | None) -> Tensor:
        """Losses (S,) on observations (S, window, batch, o) and actions (S, window, batch, n)."""

    @abstractmethod
    def step(
        self, weights: Weights, observation: Tensor, memory: Tensor | None
    ) -> tuple[Tensor, Tensor | None]:
        """Actions (S, b, n) for observations (S, b, o), and what to remember; memory None starts afresh."""

    def masks(self, steps: int, observed: int, rng: torch.Generator) -> Tensor | None:
        """Draw one network's masks (steps, batch, ...) for that many gradient steps, if it uses any.

        `observed` numbers go into the network.
        """
        return None

    def proposals(self, count: int) -> list[Policy]:
        """Up to `count` ways to act on what was learnt, the one that is tested first; a single one for most.

        Ways that draw at random draw from torch's generator.
        """
        return [self]

    def diagnostics(self, weights: Weights, observations: Tensor) -> dict[str, Tensor]:
        """Numbers (S,) that tell what the networks have learnt, on observations (S, window, batch, o)."""
        return {}


_registry: dict[str, type[Policy]] = {}

P = TypeVar("P", bound=type[Policy])


def register(name: str) -> Callable[[P], P]:
    """Make a policy class known by name; raises ValueError when a class of another module has the name."""

    def decorate(cls: P) -> P:
        known = _registry.get(name)
        if known and known.__module__ != cls.__module__:
            raise ValueError(f"policy '{name}' is registered by {known.__module__} already")
        cls.name = name
        _registry[name] = cls
        return cls

    return decorate


def policy_names() -> list[str]:
    """Names of all policies, sorted: those of this folder and those of installed entry points."""
    _discover()
    return sorted(_registry)


def kind_of(name: str) -> type[Policy]:
    """Return the class of that name; UnknownNameError otherwise."""
    _discover()
    if name not in _registry:
        raise UnknownNameError("policy", name, _registry)
    return _registry[name]


def make_policy(name: str, settings: Mapping[str, Any]) -> Policy:
    """Build a policy by name; raises PlancurateError for an unknown name, field or value."""
    cls = kind_of(name)
    for key in settings:
        if key not in cls.model_fields:
            raise UnknownNameError(f"setting of {name}", key, cls.model_fields)
    try:
        return cls(**settings)
    except ValidationError as error:
        raise PlancurateError(first_problem(f"policies.{name}.{field_of(error)}", error, cls)) from None


@cache
def _discover() -> None:
    discover("plancurate.tasks.learning.policies", ENTRY_POINTS)
