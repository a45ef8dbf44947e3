"""What a selector is given, what it gives back, and how it is found by name."""

from __future__ import annotations

import hashlib
import inspect
import json
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any, TypeVar, get_args

import duckdb
import numpy as np
import numpy.typing as npt
import pyarrow as pa
from pydantic import ValidationError

from plancurate.bounds import Settings as Settings  # for whoever writes a selector
from plancurate.errors import PlancurateError, UnknownNameError, field_of, first_problem
from plancurate.registry import discover
from plancurate.sql import load
from plancurate.tasks.curation.learning_settings import LearningSettings, Used
from plancurate.tasks.curation.names import STAGES
from plancurate.tasks.curation.pool import FloatArray, Pool

if TYPE_CHECKING:
    from plancurate.robots.robot import Robot
    from plancurate.robots.scene import Scene

IntArray = npt.NDArray[np.int64]
T = TypeVar("T")
ENTRY_POINTS = "plancurate.selectors"
MADE_BEFORE = 4
"""What `Problem.once` remembers: scores by a few seeds, for a study makes the selections of one budget first."""
_made_before: OrderedDict[Hashable, tuple[Any, dict[str, float]]] = OrderedDict()


@dataclass(eq=False)
class Stopwatch:
    """Seconds spent in each stage, by the clock given."""

    clock: Callable[[], float]
    seconds: dict[str, float] = field(default_factory=lambda: dict.fromkeys(STAGES, 0.0))
    recalled_s: float = 0.0
    """Of these, what was spent before this selection began."""

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        """Count the time spent inside the with block towards the stage."""
        start = self.clock()
        try:
            yield
        finally:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + self.clock() - start

    def recall(self, seconds: Mapping[str, float]) -> None:
        """Count time by stage that was spent earlier on what is used again now."""
        for stage, spent in seconds.items():
            self.seconds[stage] = self.seconds.get(stage, 0.0) + spent
        self.recalled_s += sum(seconds.values())


@dataclass(frozen=True, eq=False)
class Problem:
    """A pool to select from."""

    pool: Pool
    budget: int
    """Trajectories to keep a target, at least 1."""
    seed: int
    connection: duckdb.DuckDBPyConnection
    """Has the table `candidates`: the pool's candidates with their number as column `row`."""
    stage: Stopwatch
    robot: Robot
    scene: Scene
    waypoints: Callable[[Sequence[str]], list[FloatArray]]
    """Reads the waypoints (m, joints) of trajectories by id, for selectors that look inside."""
    learning: LearningSettings
    """The study's own, for selectors that train, roll out or time; what is read here must be named in `uses`."""

    def sql(self, name: str, **parameters: object) -> pa.Table:
        """Run sql/<name>.sql on the candidates."""
        return self.connection.sql(load(name), params=parameters or None).to_arrow_table()

    def once(self, what: Hashable, make: Callable[[], T]) -> T:
        """Return what `make` gives, from memory where an earlier selection of this pool and seed asked for the same.

        For scores, a few numbers a candidate, that cost much and do not depend on the budget; `what` names the
        method and all of its settings. Their time counts in each selection as if they were made for it alone.
        """
        learning = json.dumps(self.learning.identity(get_args(Used)), sort_keys=True)
        key = (what, self.pool.hash, tuple(self.pool.partition.items()), self.seed, learning)
        if key in _made_before:
            value, spent = _made_before[key]
            self.stage.recall(spent)
            return value  # type: ignore[no-any-return]
        before = dict(self.stage.seconds)
        value = make()
        spent = {stage: s - before.get(stage, 0.0) for stage, s in self.stage.seconds.items()}
        _made_before[key] = value, spent
        while len(_made_before) > MADE_BEFORE:
            _made_before.popitem(last=False)
        return value


@dataclass(frozen=True, eq=False)
class Kept:
    """What a selector chose: numbers of candidate rows, and for each, where it applies, what led to it.

    `steps`, `weight` and `q` are for selectors that do more than to keep whole trajectories as they are.
    """

    rows: IntArray
    rank: IntArray | None = None
    score: FloatArray | None = None
    cluster: IntArray | None = None
    steps: Sequence[IntArray | None] | None = None
    """Waypoints, counted from 0, at which a training window may begin; None stands for all of them."""
    weight: FloatArray | None = None
    """How much more often than by their number a trajectory's windows are drawn; 1 unless given."""
    q: Sequence[FloatArray] | None = None
    """Waypoints (m, joints) to learn from in place of the stored ones."""
    split_half: float | None = None
    """How stably the score ranks, for selectors that are `estimated`: see `ranking.split_half`."""


Choose = Callable[[Problem, Any], Kept]


@dataclass(frozen=True)
class Selector:
    """A registered way of choosing. `origin` tells versions of a selector from elsewhere apart."""

    name: str
    choose: Choose
    settings: type[Settings]
    description: str
    origin: str
    budgeted: bool
    seeded: bool
    """Whether another seed can give another selection."""
    estimated: bool
    """Whether its scores are estimated, so that `Kept.split_half` says how stably they rank."""
    revision: int
    """Raised by the selector's author when it selects otherwise than before from the same pool."""
    uses: tuple[Used, ...]
    """Which of the study's settings decide what it keeps."""
    warm_up: Callable[[], object] | None
    """What its first call costs beyond the others, to be paid before its time is measured."""

    def parse(self, parameters: Mapping[str, object]) -> Settings:
        """Check parameters; PlancurateError that names the first wrong one."""
        try:
            return self.settings.model_validate(dict(parameters))
        except ValidationError as error:
            valid = ", ".join(self.settings.model_fields) or "none"
            problem = first_problem(
                f"selector {self.name}: parameter {field_of(error)}", error, self.settings
            )
            raise PlancurateError(f"{problem} (parameters: {valid})") from None


_registry: dict[str, Selector] = {}


def selector(
    name: str,
    settings: type[Settings] = Settings,
    *,
    budgeted: bool = True,
    seeded: bool = True,
    estimated: bool = False,
    uses: tuple[Used, ...] = (),
    revision: int = 1,
) -> Callable[[Choose], Choose]:
    """Register the decorated function under a name; the first line of its docstring describes it.

    `budgeted=False` says that it keeps what it keeps, whatever the budget, `seeded=False` that it never draws,
    `estimated=True` that it gives `Kept.split_half`; `uses` names the settings of the study that it reads from
    `Problem.learning`, so that it selects anew when these change, and only then.
    """

    def register(choose: Choose) -> Choose:
        description = (inspect.getdoc(choose) or "").split("\n")[0]
        add(
            name,
            choose,
            settings,
            description,
            budgeted=budgeted,
            seeded=seeded,
            estimated=estimated,
            uses=uses,
            revision=revision,
        )
        return choose

    return register


def add(
    name: str,
    choose: Choose,
    settings: type[Settings],
    description: str,
    *,
    budgeted: bool = True,
    seeded: bool = True,
    estimated: bool = False,
    uses: tuple[Used, ...] = (),
    warm_up: Callable[[], object] | None = None,
    revision: int = 1,
) -> None:
    """Register a selector; ValueError when another function has the name or `uses` names no such settings."""
    known = _registry.get(name)
    if known and known.choose.__module__ != choose.__module__:
        raise ValueError(f"selector '{name}' is registered by {known.choose.__module__} already")
    if unknown := set(uses) - set(get_args(Used)):
        raise ValueError(
            f"selector '{name}' uses {', '.join(unknown)}; settings are {', '.join(get_args(Used))}"
        )
    origin = _origin(choose)
    _registry[name] = Selector(
        name, choose, settings, description, origin, budgeted, seeded, estimated, revision, uses, warm_up
    )


def find_selector(name: str) -> Selector:
    """The selector of that name; UnknownNameError otherwise."""
    _discover()
    if name not in _registry:
        raise UnknownNameError("selector", name, _registry)
    return _registry[name]


def selector_names() -> list[str]:
    """Names of all selectors, sorted: those of this folder and those of installed entry points."""
    _discover()
    return sorted(_registry)


@cache
def _discover() -> None:
    discover("plancurate.tasks.curation.selectors", ENTRY_POINTS)


def _origin(choose: Choose) -> str:
    """Digest of the source of a selector from elsewhere: an edited one must not pass for its older self."""
    if choose.__module__.startswith("plancurate."):
        return ""
    return hashlib.sha256(inspect.getsource(choose).encode()).hexdigest()[:12]
