"""Run a selector on a pool: what was kept, why, and how long it took."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa

from plancurate.errors import PlancurateError
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.tasks.curation.learning_settings import LearningSettings
from plancurate.tasks.curation.names import STAGES, labelled
from plancurate.tasks.curation.pool import FloatArray, Pool
from plancurate.tasks.curation.selectors.base import Kept, Problem, Selector, Stopwatch, find_selector
from plancurate.tasks.lake import engine
from plancurate.tasks.lake.schema import table

POOL_COLUMNS = ("trajectory_id", "target_id", "planner", "goal_index")
KEPT_COLUMNS = (*POOL_COLUMNS, "cluster", "score", "rank", "steps", "weight", "q")


@dataclass(frozen=True, eq=False)
class Selection:
    """Trajectories that a selector kept of a pool."""

    selection_id: str
    selector: str
    """As tables show it: with the parameters that were given."""
    budget: int | None
    """Trajectories a target; None where the selector has no budget."""
    seed: int
    params: Mapping[str, object]
    pool_hash: str
    n_pool: int
    n_targets: int
    seconds: Mapping[str, float]
    """By stage."""
    selection_time_s: float
    """From the loaded candidates to the list of kept ids."""
    kept: pa.Table
    """KEPT_COLUMNS: one row a trajectory, by id."""
    split_half: float | None = None
    """How stably its scores rank, where they are estimated and it was made just now."""

    @property
    def ids(self) -> list[str]:
        """Ids of the kept trajectories."""
        return list(self.kept["trajectory_id"].to_pylist())

    def rows(self) -> pa.Table:
        """The selection as rows of the lake's `selections`."""
        schema = table("selections").schema
        same = {
            "selection_id": self.selection_id, "selector": self.selector, "seed": self.seed, "budget": self.budget,
            "pool_hash": self.pool_hash, "n_targets": self.n_targets, "n_pool": self.n_pool,
            "params": json.dumps(self.params, sort_keys=True), "selection_time_s": self.selection_time_s,
            **{f"{stage}_s": self.seconds[stage] for stage in STAGES},
        }  # fmt: skip
        repeated = {
            name: pa.repeat(pa.scalar(value, schema.field(name).type), len(self.kept))
            for name, value in same.items()
        }
        return pa.table({**repeated, **dict(zip(self.kept.column_names, self.kept.columns, strict=True))})


def select(
    name: str,
    pool: Pool,
    budget: int | None,
    seed: int,
    params: Mapping[str, object] | None = None,
    *,
    robot: Robot,
    scene: Scene,
    waypoints: Callable[[Sequence[str]], list[FloatArray]],
    learning: LearningSettings,
    clock: Callable[[], float] = time.perf_counter,
) -> Selection:
    """Run the selector `name`; PlancurateError for wrong parameters or a budget below 1.

    ValueError when the selector is registered as `estimated` and does not say how stably it ranks, or the reverse.
    """
    chosen = find_selector(name)
    settings = chosen.parse(params or {})
    budget = checked_budget(chosen, budget)
    if chosen.warm_up:
        chosen.warm_up()
    with engine.connect() as connection:
        watch = Stopwatch(clock)
        start = clock()
        with watch("prepare"):
            numbered = pool.candidates.append_column("row", pa.array(np.arange(pool.candidates.num_rows)))
            connection.register("candidates", numbered)
        problem = Problem(pool, budget or 1, seed, connection, watch, robot, scene, waypoints, learning)
        kept = chosen.choose(problem, settings)
        if chosen.estimated != (kept.split_half is not None):
            raise ValueError(
                f"selector {name}: estimated={chosen.estimated}, but split_half={kept.split_half}"
            )
        with watch("select"):
            rows = _kept_rows(pool, kept)
        elapsed = clock() - start + watch.recalled_s
    return Selection(
        selection_id=selection_id(chosen, pool, budget, seed, settings.model_dump(), learning),
        selector=labelled(name, params or {}),
        budget=budget,
        seed=seed,
        params=settings.model_dump(),
        pool_hash=pool.hash,
        n_pool=pool.candidates.num_rows,
        n_targets=pool.n_targets,
        seconds=watch.seconds,
        selection_time_s=elapsed,
        kept=rows,
        split_half=kept.split_half,
    )


def selection_id(
    chosen: Selector,
    pool: Pool,
    budget: int | None,
    seed: int,
    params: Mapping[str, object],
    learning: LearningSettings,
) -> str:
    """Name a selection by what it is made from, so that the same request has the same name."""
    content = [chosen.origin, chosen.revision, budget, seed, pool.hash, params]
    used = learning.identity(chosen.uses)
    inputs = json.dumps([chosen.name, *content, used], sort_keys=True)
    size = "all" if budget is None else f"k{budget}"
    return f"{chosen.name}-{size}-s{seed}-{hashlib.sha256(inputs.encode()).hexdigest()[:10]}"


def checked_budget(chosen: Selector, budget: int | None) -> int | None:
    """The budget that counts for this selector; PlancurateError when it needs one of at least 1."""
    if not chosen.budgeted:
        return None
    if budget is None or budget < 1:
        raise PlancurateError(f"selector {chosen.name}: budget is {budget}, it must be at least 1")
    return budget


def _kept_rows(pool: Pool, kept: Kept) -> pa.Table:
    schema = table("selections").schema
    picked = pool.candidates.select(POOL_COLUMNS).take(kept.rows)
    for name in KEPT_COLUMNS[len(POOL_COLUMNS) :]:
        values = getattr(kept, name)
        kind = schema.field(name).type
        column = pa.nulls(len(kept.rows), kind) if values is None else _column(values, kind)
        picked = picked.append_column(name, column)
    return picked.sort_by("trajectory_id")


def _column(values: Any, kind: pa.DataType) -> pa.Array:
    if pa.types.is_list(kind):  # of arrays of different lengths
        return pa.array([value if value is None else np.asarray(value).tolist() for value in values], kind)
    return pa.array(values).cast(kind)
