"""Curate: keep part of a pool and record in the lake what was kept and why."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping

from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.tasks.curation.learning_settings import LearningSettings
from plancurate.tasks.curation.pool import Pool, load_waypoints
from plancurate.tasks.curation.selectors.base import STAGES, find_selector
from plancurate.tasks.curation.selectors.selection import (
    KEPT_COLUMNS,
    Selection,
    checked_budget,
    select,
    selection_id,
)
from plancurate.tasks.lake import Lake

_SAME = (
    "selection_id", "selector", "budget", "seed", "pool_hash", "n_pool", "n_targets", "selection_time_s",
)  # fmt: skip


def curate(
    lake: Lake,
    pool: Pool,
    selector: str,
    budget: int | None,
    seed: int,
    params: Mapping[str, object] | None = None,
    *,
    robot: Robot,
    scene: Scene,
    learning: LearningSettings,
    metadata: Mapping[str, str],
    clock: Callable[[], float] = time.perf_counter,
) -> Selection:
    """Return the selection, made now or found in the lake; `metadata` goes in its part's footer.

    `learning` are the study's settings, for selectors that train, roll out or time.
    PlancurateError for an unknown selector, wrong parameters or a budget that the pool can't meet.
    """
    chosen = find_selector(selector)
    settings = chosen.parse(params or {}).model_dump()
    key = selection_id(chosen, pool, checked_budget(chosen, budget), seed, settings, learning)
    partition = {**pool.partition, "selector": selector}
    if key in lake.keys("selections", partition):
        return stored_selection(lake, partition, key)
    selection = select(
        selector,
        pool,
        budget,
        seed,
        params,
        robot=robot,
        scene=scene,
        waypoints=lambda ids: load_waypoints(lake, pool.partition, ids),
        learning=learning,
        clock=clock,
    )
    lake.write("selections", partition, key, selection.rows(), metadata)
    return selection


def stored_selection(lake: Lake, partition: Mapping[str, str], key: str) -> Selection:
    """Read a selection back from the partition (robot, scene, pool, selector) of the lake."""
    rows = lake.query("pool/selection", selection_id=key, **partition)
    first = {name: rows[name][0].as_py() for name in rows.column_names}
    return Selection(
        params=json.loads(first["params"]),
        seconds={stage: first[f"{stage}_s"] for stage in STAGES},
        kept=rows.select(KEPT_COLUMNS),
        **{name: first[name] for name in _SAME},
    )
