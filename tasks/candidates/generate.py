"""Generate candidates: plan to each target, then time, measure and play back each path, one row a run."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from functools import partial

import numpy as np
import pyarrow as pa

from plancurate import native
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.tasks.candidates import consistent_goals, relaxed
from plancurate.tasks.candidates.plan import plan_candidate
from plancurate.tasks.candidates.postprocess import Postprocess, postprocess
from plancurate.tasks.candidates.rows import Columns, candidate_row
from plancurate.tasks.candidates.settings import GenerateSettings
from plancurate.tasks.candidates.sources import PlannedPath, find_source
from plancurate.tasks.candidates.targets import Target
from plancurate.tasks.lake.schema import table

REVISION = 2  # raise when results change: targets, goals, timing, metrics or playback of the same settings

MISSED = 1e-3  # m between a path's end and its target; nobody who plans to the target misses it by more


@dataclass(frozen=True)
class StageSeconds:
    """Wall time of the stages of generation, s."""

    plan: float
    timing: float
    verify: float


def pool_id(robot: Robot, scene: Scene, settings: GenerateSettings) -> str:
    """Name the pool of candidates that belong together; more targets and other planners add to it."""
    content: list[object] = [
        REVISION,
        native.ompl_version(),
        robot.digest,
        scene.digest,
        settings.model_dump(mode="json"),
    ]
    if settings.plan.goals == "consistent":
        content.append(consistent_goals.REVISION)
    if settings.plan.simplification == "relaxed":
        content.append(relaxed.REVISION)
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:12]


def generate_candidates(
    robot: Robot,
    scene: Scene,
    targets: list[Target],
    planner: str,
    settings: GenerateSettings,
    postprocess_path: Postprocess | None = None,
    pool: str | None = None,
    first_run: int = 0,
) -> tuple[pa.Table, StageSeconds]:
    """Plan one source's runs to `targets`, from `first_run` on; a row of `trajectories` for each, failed ones too.

    `pool` is the id of the pool that they belong to, where it isn't that of the scene alone. Rows depend on nothing
    but the arguments, measured seconds excepted. `postprocess_path` does the part that holds the interpreter's lock:
    here by default, or in other processes (`PostprocessPool`). Raises PlancurateError for a planner or parameter that
    is not known.
    """
    if postprocess_path is None:
        postprocess_path = partial(
            postprocess, robot, scene, timing=settings.timing, playback=settings.verify
        )
    pool, label = pool or pool_id(robot, scene, settings), find_source(planner).label
    rows = []
    for target in targets:
        for run in range(first_run, settings.plan.runs):
            planned = plan_candidate(robot, scene, target, planner, run, settings)
            row = run_row(robot, target, planned, postprocess_path)
            rows.append(named(row, label, pool, settings))
    seconds = StageSeconds(
        *(sum(row[f"{stage}_s"] for row in rows) for stage in ("plan", "timing", "verify"))
    )
    return pa.Table.from_pylist(rows, table("trajectories").schema), seconds


def run_row(
    robot: Robot, target: Target, planned: PlannedPath, postprocess_path: Postprocess, missed: float = MISSED
) -> Columns:
    """What became of one run, whose path may end as far from the target as `missed`, m."""
    held = held_to_target(robot, target, planned, missed)
    exact = held.status == "exact"
    return candidate_row(target, held, postprocess_path(held.path, target.position) if exact else None)


def named(row: Columns, label: str, pool: str, settings: GenerateSettings) -> Columns:
    """The row of one run with its id in the lake, under its source's label, and how it is sampled."""
    name = trajectory_id(row["target_id"], label, row["run"], pool)
    return {"trajectory_id": name, "dt": settings.timing.dt, **row}


def trajectory_id(target_id: int, label: str, run: int, pool: str) -> str:
    """Name one run of a source in the lake."""
    return f"t{target_id:04d}-{label}-r{run}-{pool}"


def held_to_target(robot: Robot, target: Target, planned: PlannedPath, missed: float) -> PlannedPath:
    """The run itself; as one without a solution when it claims a path that ends elsewhere."""
    if planned.status != "exact":
        return planned
    tool = native.fk(robot.native, planned.path[-1:])[0, :3, 3]
    distance = float(np.linalg.norm(tool - target.position))
    if distance <= missed:
        return planned
    reason = f"the path ends {distance:.3f} m from the target"
    return PlannedPath(planned.run, planned.seed, "approximate", planned.path, reason, planned.termination)
