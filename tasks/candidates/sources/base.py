"""What yields paths to targets, and how it is found by name.

A source is a function in a module of this folder, or of an installed package that names the module as an entry
point of the group `plancurate.sources`. Nothing heavy is imported here: names are asked for by every command.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Protocol

from plancurate.errors import UnknownNameError
from plancurate.registry import discover

if TYPE_CHECKING:
    from plancurate.robots.robot import Robot
    from plancurate.robots.scene import Scene
    from plancurate.robots.shapes import FloatArray
    from plancurate.tasks.candidates.settings import GenerateSettings
    from plancurate.tasks.candidates.targets import Target

ENTRY_POINTS = "plancurate.sources"


@dataclass(frozen=True, eq=False)
class PlannedPath:
    """What became of one run of a source."""

    run: int
    seed: int
    status: str
    """"exact", "approximate" (the path ends short of the target) or "none"; only exact ones become trajectories."""
    path: FloatArray
    """Waypoints (w, n), rad, joined by straight lines; (0, n) when there is none."""
    reason: str = ""
    """Why the status is not "exact"."""
    termination: str = "solved"
    """What ended the run: "solved", or what it ran out of."""
    state_checks: int = 0
    motion_checks: int = 0
    seconds: float = 0.0


class Plan(Protocol):
    """A path from the robot's home to `target`; the same arguments give the same path on every machine.

    `seed` is the run's own: whatever is drawn is drawn from it. The path need not be timed or free: it is timed,
    checked and played back afterwards. Raises PlancurateError for settings that it can't work with.
    """

    def __call__(
        self, robot: Robot, scene: Scene, target: Target, run: int, seed: int, settings: GenerateSettings
    ) -> PlannedPath:
        """Plan one run."""


@dataclass(frozen=True)
class Source:
    """A registered source of trajectories."""

    name: str
    plan: Plan
    revision: int
    """Raised by its author when its paths change for the same arguments."""
    params: Mapping[str, str] = field(default_factory=dict)
    """Parameters that `PlanSettings.params` may set, with their defaults."""

    @property
    def label(self) -> str:
        """What its rows are kept under in the lake: the name, from the second revision on with its number.

        So rows of an earlier revision stay what they are, and a raised one is planned anew beside them.
        """
        return self.name if self.revision == 1 else f"{self.name}.{self.revision}"


_registry: dict[str, Source] = {}


def add_source(source: Source) -> None:
    """Register a source; ValueError when another module has the name."""
    known = _registry.get(source.name)
    if known and _module(known) != _module(source):
        raise ValueError(f"source '{source.name}' is registered by {_module(known)} already")
    _registry[source.name] = source


def source(name: str, revision: int = 1, params: Mapping[str, str] | None = None) -> Callable[[Plan], Plan]:
    """Register the decorated function as the source of that name."""

    def register(plan: Plan) -> Plan:
        add_source(Source(name, plan, revision, params or {}))
        return plan

    return register


def find_source(name: str) -> Source:
    """The source of that name; UnknownNameError otherwise."""
    _discover()
    if name not in _registry:
        raise UnknownNameError("planner", name, _registry)
    return _registry[name]


def source_names() -> list[str]:
    """Names of all sources: OMPL's planners in their order, then those of other files and installed packages."""
    _discover()
    return list(_registry)


@cache
def _discover() -> None:
    discover("plancurate.tasks.candidates.sources", ENTRY_POINTS)


def _module(source: Source) -> str:
    return getattr(source.plan, "__module__", type(source.plan).__module__)
