"""Generate candidates: plan to each target, then time, measure and play back each path, one row a run."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from functools import partial

import pyarrow as pa

from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.tasks.candidates.plan import plan_candidate
from plancurate.tasks.candidates.postprocess import Postprocess, postprocess
from plancurate.tasks.candidates.rows import candidate_row
from plancurate.tasks.candidates.settings import GenerateSettings
from plancurate.tasks.candidates.targets import Target
from plancurate.tasks.lake.schema import table


@dataclass(frozen=True)
class StageSeconds:
    """Wall time of the stages of generation, s."""

    plan: float
    timing: float
    verify: float


def pool_id(robot: Robot, scene: Scene, settings: GenerateSettings) -> str:
    """Name the pool of candidates that belong together; more targets and other planners add to it."""
    content = [robot.digest, scene.digest, settings.model_dump(mode="json")]
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:12]


def generate_candidates(
    robot: Robot,
    scene: Scene,
    targets: list[Target],
    planner: str,
    settings: GenerateSettings,
    postprocess_path: Postprocess | None = None,
) -> tuple[pa.Table, StageSeconds]:
    """Plan all runs of one planner to `targets`; return a row of `trajectories` for each, failed ones too.

    Rows depend on nothing but the arguments, measured seconds excepted. `postprocess_path` does the part that
    holds the interpreter's lock: here by default, or in other processes (`PostprocessPool`). Raises
    PlancurateError for a planner or parameter that is not known.
    """
    if postprocess_path is None:
        postprocess_path = partial(
            postprocess, robot, scene, timing=settings.timing, playback=settings.verify
        )
    pool = pool_id(robot, scene, settings)
    rows = []
    for target in targets:
        for run in range(settings.plan.runs):
            planned = plan_candidate(robot, scene, target, planner, run, settings.plan)
            exact = planned.result.status == "exact"
            finished = postprocess_path(planned.result.path, target.position) if exact else None
            name = f"t{target.target_id:04d}-{planner}-r{run}-{pool}"
            row = candidate_row(target, planned, finished)
            rows.append({"trajectory_id": name, "dt": settings.timing.dt, **row})
    seconds = StageSeconds(
        *(sum(row[f"{stage}_s"] for row in rows) for stage in ("plan", "timing", "verify"))
    )
    return pa.Table.from_pylist(rows, table("trajectories").schema), seconds
