"""Curate: keep part of a pool and record in the lake what was kept and why."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from dataclasses import replace

import pyarrow as pa

from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.tasks.curation.learning_settings import LearningSettings
from plancurate.tasks.curation.names import STAGES
from plancurate.tasks.curation.pool import Pool, load_waypoints
from plancurate.tasks.curation.selector_choice import SelectorChoice
from plancurate.tasks.curation.selectors.selection import (
    KEPT_COLUMNS,
    Selection,
    checked_budget,
    select,
    selection_id,
)
from plancurate.tasks.lake.store import Lake

_SAME = (
    "selection_id", "selector", "budget", "seed", "pool_hash", "n_pool", "n_targets", "selection_time_s",
)  # fmt: skip


def curate(
    lake: Lake,
    pool: Pool,
    study: str,
    choice: SelectorChoice,
    budget: int | None,
    seed: int,
    *,
    robot: Robot,
    scene: Scene,
    learning: LearningSettings,
    metadata: Mapping[str, str],
    clock: Callable[[], float] = time.perf_counter,
) -> Selection:
    """Return a study's selection, made now or found in the lake; `metadata` goes in its part's footer.

    What another study selected from the same pool in the same way is taken over, measured times included. One whose
    part of `rankings` is lost is made again for that part alone.
    `learning` are the study's settings, for selectors that train, roll out or time.
    PlancurateError for a budget below 1.
    """
    key = wanted_id(pool, choice, budget, seed, learning)
    partition = {**pool.partition, "study": study}
    own = key in lake.keys("selections", partition)
    known = partition if own else lake.locate("selections", pool.partition, key)
    ranked = not choice.selector.estimated or key in lake.keys("rankings", pool.partition)
    selection = known and replace(stored_selection(lake, known, key), selector=choice.label)
    if not selection or not ranked:
        made = select(
            choice.name,
            pool,
            budget,
            seed,
            choice.params,
            robot=robot,
            scene=scene,
            waypoints=lambda ids: load_waypoints(lake, pool.partition, ids),
            learning=learning,
            clock=clock,
        )
        if choice.selector.estimated:
            row = pa.table({"selection_id": [key], "split_half": [made.split_half]})
            lake.write("rankings", pool.partition, key, row, metadata)
        selection = selection or made
    if not own:
        lake.write("selections", partition, key, selection.rows(), metadata)
    return selection


def wanted_id(
    pool: Pool, choice: SelectorChoice, budget: int | None, seed: int, learning: LearningSettings
) -> str:
    """Name the selection that `curate` returns for the same arguments."""
    chosen = choice.selector
    settings = chosen.parse(choice.params).model_dump()
    return selection_id(chosen, pool, checked_budget(chosen, budget), seed, settings, learning)


def stored_selection(lake: Lake, partition: Mapping[str, str], key: str) -> Selection:
    """Read a selection back from the partition (robot, scene, pool, study) of the lake."""
    rows = lake.query("pool/selection", selection_id=key, **partition)
    first = {name: rows[name][0].as_py() for name in rows.column_names}
    return Selection(
        params=json.loads(first["params"]),
        seconds={stage: first[f"{stage}_s"] for stage in STAGES},
        kept=rows.select(KEPT_COLUMNS),
        **{name: first[name] for name in _SAME},
    )
