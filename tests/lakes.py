"""A small lake with made-up content."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from plancurate.tasks.lake.schema import table
from plancurate.tasks.lake.store import Lake

POOL = {"robot": "h2017", "scene": "free", "pool": "0a1b2c"}
POSITIONS = [[0.5, 0.0, 0.6], [0.3, 0.2, 0.5], [0.6, -0.2, 0.7]]


def trajectory(target_id: int, planner: str, run: int, **changes: object) -> dict[str, object]:
    """A row of `trajectories` for a made-up robot of three joints that are its tool's coordinates."""
    x, y, z = POSITIONS[target_id]
    rng = np.random.default_rng([target_id, run, *planner.encode()])
    q = np.linspace([0, 0, 0], [x, y, z], 11) + np.pad(rng.normal(0, 0.1, (9, 3)), ((1, 1), (0, 0)))
    q = q.astype(np.float32).astype(np.float64)
    steps = np.diff(q, axis=0)
    return {
        "trajectory_id": f"t{target_id:04d}-{planner}-r{run}-{POOL['pool']}",
        "target_id": target_id, "run": run, "seed": 7, "status": "exact", "reason": "", "solved": True,
        "termination": "solved", "state_checks": 100, "motion_checks": 10, "goal_index": run % 2,
        "n_path_waypoints": 3, "timing_method": "spline", "target_x": x, "target_y": y, "target_z": z,
        "tool_x": q[-1, 0], "tool_y": q[-1, 1], "tool_z": q[-1, 2],
        "joint_movement": np.abs(steps).sum(),
        "smoothness": np.linalg.norm(np.diff(steps, axis=0), axis=1).sum() / 0.05**2,
        "path_length": np.linalg.norm(steps, axis=1).sum(), "duration": 0.5,
        "final_distance": np.linalg.norm(q[-1] - [x, y, z]), "n_waypoints": 11, "verified": True,
        "max_tracking_error_rad": 0.001, "final_tracking_error_m": 0.001, "contacts": 0,
        "saturated_share": 0.0, "verify_reason": "", "plan_s": 0.01, "timing_s": 0.02, "verify_s": 0.03,
        "dt": 0.05, "q": q.tolist(),
    } | changes  # fmt: skip


def failed(target_id: int, planner: str, run: int) -> dict[str, object]:
    """A row of `trajectories` of a run that found nothing."""
    nothing = dict.fromkeys(
        ("tool_x", "tool_y", "tool_z", "joint_movement", "smoothness", "path_length", "duration",
         "final_distance", "max_tracking_error_rad", "final_tracking_error_m", "contacts",
         "saturated_share", "verify_reason")
    )  # fmt: skip
    changes = {"status": "none", "reason": "no path", "solved": False, "verified": False, "q": []}
    return trajectory(target_id, planner, run, **nothing, **changes, n_waypoints=0, timing_method="")


@pytest.fixture(scope="session")
def small_lake_once(tmp_path_factory: pytest.TempPathFactory) -> Lake:
    """A lake of three targets, two planners and three runs each; one run failed, one is not verified."""
    lake = Lake(tmp_path_factory.mktemp("small") / "lake")
    targets = [
        {"target_id": i, **dict(zip("xyz", position, strict=True)), "goals": [position]}
        for i, position in enumerate(POSITIONS)
    ]
    lake.write("targets", POOL, "000000-000002", pa.Table.from_pylist(targets, table("targets").schema), {})
    for planner in ("RRT", "PRM"):
        for target_id in range(3):
            rows = [trajectory(target_id, planner, run) for run in range(3)]
            if (target_id, planner) == (1, "RRT"):
                rows[1:] = [failed(1, "RRT", 1), trajectory(1, "RRT", 2, verified=False)]
            part = pa.Table.from_pylist(rows, table("trajectories").schema)
            lake.write("trajectories", {**POOL, "planner": planner}, f"{target_id:06d}", part, {"seed": "7"})
    return lake


@pytest.fixture
def small_lake(small_lake_once: Lake, tmp_path: Path) -> Lake:
    """A copy of the small lake to write into."""
    return copied(small_lake_once, tmp_path)


def copied(lake: Lake, folder: Path) -> Lake:
    """A copy of a lake in a folder."""
    shutil.copytree(lake.root, folder / "lake")
    return Lake(folder / "lake")
