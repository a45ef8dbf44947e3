"""Candidates of a real robot that nobody planned, and selections of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pyarrow as pa
import pytest

from plancurate.robots import Robot, Scene, load_world
from plancurate.tasks.curation.curate import STAGES
from plancurate.tasks.curation.pool import FloatArray, Pool, make_pool
from plancurate.tasks.curation.selectors.selection import KEPT_COLUMNS, Selection
from plancurate.tasks.exports.episodes import Episodes, make_episodes
from plancurate.tasks.lake.schema import table

PARTITION = {"robot": "h2017", "scene": "table", "pool": "0a1b2c"}
POSITIONS = [[0.5, 0.1, 0.6], [0.4, -0.2, 0.5]]


@pytest.fixture(scope="session")
def world() -> tuple[Robot, Scene]:
    return load_world("h2017", "table")


@pytest.fixture(scope="session")
def waypoints(world: tuple[Robot, Scene]) -> Mapping[str, FloatArray]:
    """Six trajectories of 5 to 10 waypoints that begin at home, as the lake gives them."""
    rng = np.random.default_rng(0)
    steps = {
        f"t{target}-r{run}": rng.normal(0, 0.02, (4 + target + 2 * run, 6))
        for target in (0, 1)
        for run in range(3)
    }
    return {
        name: np.float32(world[0].home + np.cumsum(np.vstack([np.zeros(6), step]), axis=0)).astype(float)
        for name, step in steps.items()
    }


@pytest.fixture(scope="session")
def pool(waypoints: Mapping[str, FloatArray]) -> Pool:
    rows = [
        {
            "trajectory_id": name, "target_id": int(name[1]), "planner": "RRT", "run": int(name[-1]), "goal_index": 0,
            "joint_movement": 1.0 + number, "smoothness": 2.0, "path_length": 0.5, "duration": 0.05 * (len(q) - 1),
            "final_distance": 0.0, "tool_x": 0.0, "tool_y": 0.0, "tool_z": 0.0, "n_waypoints": len(q), "dt": 0.05,
            "way": None, "multiplicity": 1,
        }
        for number, (name, q) in enumerate(waypoints.items())
    ]  # fmt: skip
    columns = pa.Table.from_pylist(rows)
    way = columns.column_names.index("way")
    columns = columns.set_column(way, "way", columns["way"].cast(pa.string()))
    targets = [{"target_id": i, **dict(zip("xyz", at, strict=True))} for i, at in enumerate(POSITIONS)]
    return make_pool(PARTITION, columns, pa.Table.from_pylist(targets))


def selected(pool: Pool, name: str, kept: Sequence[Mapping[str, object]], **changes: object) -> Selection:
    """A selection of these trajectories, with what is said of each beside its id."""
    kinds = table("selections").schema
    rows = [
        {"target_id": int(str(row["trajectory_id"])[1]), "planner": "RRT", "goal_index": 0, **row}
        for row in kept
    ]
    fields = pa.schema([pa.field(column, kinds.field(column).type) for column in KEPT_COLUMNS])
    content: dict[str, object] = {
        "selection_id": name, "selector": name, "budget": 2, "seed": 0, "params": {}, "pool_hash": pool.hash,
        "n_pool": 6, "n_targets": 2, "seconds": dict.fromkeys(STAGES, 0.0), "selection_time_s": 0.0,
    }  # fmt: skip
    return Selection(**content | changes, kept=pa.Table.from_pylist(rows, fields))  # type: ignore[arg-type]


@pytest.fixture(scope="session")
def selections(pool: Pool, waypoints: Mapping[str, FloatArray]) -> list[Selection]:
    """One that ranks, one that leaves steps out, one that shortens what it keeps."""
    return [
        selected(
            pool,
            "Ranked",
            [{"trajectory_id": name, "score": -k, "rank": k} for k, name in enumerate(("t0-r1", "t1-r2"), 1)],
        ),
        selected(
            pool,
            "Stepwise",
            [
                {"trajectory_id": "t0-r0", "steps": [0, 3], "weight": 2.0},
                {"trajectory_id": "t1-r0", "steps": None, "weight": 1.0},
            ],
            budget=None,
        ),
        selected(
            pool, "Shorter", [{"trajectory_id": "t1-r2", "q": waypoints["t1-r2"][::2].tolist()}], budget=None
        ),
    ]


@pytest.fixture(scope="session")
def episodes(
    world: tuple[Robot, Scene],
    pool: Pool,
    selections: list[Selection],
    waypoints: Mapping[str, FloatArray],
) -> Episodes:
    robot, scene = world
    return make_episodes(
        robot,
        scene,
        pool,
        selections,
        lambda ids: [waypoints[name] for name in ids],
        ("target_offset", "scene_parameters"),
    )
