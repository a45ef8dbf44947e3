from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pyarrow as pa
import pytest

from plancurate import native
from plancurate.robots import load_robot, load_scene
from plancurate.robots.scene import Scene
from plancurate.tasks.candidates.settings import TimingSettings
from plancurate.tasks.candidates.time_parameterisation import Timed, problem_of, time_path
from plancurate.tasks.curation.learning_settings import LearningSettings
from plancurate.tasks.curation.pool import make_pool
from plancurate.tasks.curation.selectors import repair as repair_module
from plancurate.tasks.curation.selectors.repair import repaired_trajectory
from plancurate.tasks.curation.selectors.selection import Selection, select
from plancurate.tasks.learning.settings import TrainSettings

from .defects import LEARNING

ROBOT = load_robot("h2017")
FREE, TABLE = load_scene("free"), load_scene("table")
TIMING = TimingSettings()
GOAL = ROBOT.home + np.array([0.6, 0.2, -0.3, 0.0, 0.1, 0.0])


def timed(scene: Scene, *corners: np.ndarray) -> np.ndarray:
    """What would be stored of a path from home over `corners`."""
    found = time_path(ROBOT, scene, np.array([ROBOT.home, *corners]), TIMING)
    assert not found.reason
    return found.q


def detoured(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return timed(FREE, *(ROBOT.home + rng.uniform(-0.4, 0.4, (3, ROBOT.dof))), GOAL)


def length(q: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(q, axis=0), axis=1).sum())


def select_repair(
    scene: Scene, trajectories: Sequence[np.ndarray], seed: int = 0, learning: LearningSettings = LEARNING
) -> Selection:
    n = len(trajectories)
    numbers = np.arange(n)
    metrics = ("joint_movement", "smoothness", "path_length", "duration", "final_distance")
    columns = {
        "trajectory_id": [f"c{row:03d}" for row in numbers], "planner": ["RRT"] * n,
        "target_id": pa.array(np.zeros(n), pa.int32()), "run": pa.array(numbers, pa.int32()),
        "goal_index": pa.array(np.zeros(n), pa.int32()), "dt": np.full(n, TIMING.dt),
        "n_waypoints": pa.array([len(q) for q in trajectories], pa.int32()),
        **{name: np.zeros(n) for name in (*metrics, "tool_x", "tool_y", "tool_z")},
        "multiplicity": np.ones(n, dtype=np.int64),
    }  # fmt: skip
    targets = pa.table({"target_id": pa.array([0], pa.int32()), "x": [0.0], "y": [0.0], "z": [0.0]})
    pool = make_pool({"robot": "h2017", "scene": "made up", "pool": "0"}, pa.table(columns), targets)

    def waypoints(ids: Sequence[str]) -> list[np.ndarray]:
        return [trajectories[int(name[1:])] for name in ids]

    return select(
        "Repair", pool, None, seed, robot=ROBOT, scene=scene, waypoints=waypoints, learning=learning
    )


def repaired(scene: Scene, trajectories: Sequence[np.ndarray], seed: int = 0) -> list[np.ndarray]:
    return [np.array(q) for q in select_repair(scene, trajectories, seed).kept["q"].to_pylist()]


def test_detours_get_shorter_and_quicker_with_the_same_ends() -> None:
    stored = [detoured(seed) for seed in range(5)]
    for before, after in zip(stored, repaired(FREE, stored), strict=True):
        assert length(after) < 0.8 * length(before)
        assert len(after) < len(before)
        np.testing.assert_array_equal(after[[0, -1]], before[[0, -1]])
        assert problem_of(ROBOT, FREE, after, TIMING) == ""


@cache
def planned_around_the_table() -> list[np.ndarray]:
    """Trajectories of raw planner paths to where no straight way leads."""
    goals = ROBOT.home + np.random.default_rng(0).uniform(-1.2, 1.2, (200, ROBOT.dof))
    goals = goals[native.is_free(ROBOT.native, TABLE.native, goals)]
    homes = np.repeat(ROBOT.home[None], len(goals), axis=0)
    hidden = goals[~native.edge_is_free(ROBOT.native, TABLE.native, homes, goals, 0.01)]
    budget = native.Budget(state_checks=50_000, polls=20_000, seconds=60)
    found = []
    for goal in hidden[:8]:
        result = native.plan(
            ROBOT.native, TABLE.native, "RRTConnect", ROBOT.home, goal[None],
            params={}, seed=1, budget=budget, resolution=0.01, simplification="off",
        )  # fmt: skip
        if result.status == "exact":
            found.append(time_path(ROBOT, TABLE, result.path, TIMING).q)
    return [q for q in found if len(q)]


def test_repairs_around_obstacles_are_free_and_lead_to_the_same_goals() -> None:
    stored = planned_around_the_table()
    assert len(stored) >= 4
    after = repaired(TABLE, stored)
    for q, new in zip(stored, after, strict=True):
        assert problem_of(ROBOT, TABLE, new, TIMING) == ""
        np.testing.assert_array_equal(new[[0, -1]], q[[0, -1]])
        assert length(new) <= length(q)
    ratios = [length(new) / length(q) for q, new in zip(stored, after, strict=True)]
    assert np.median(ratios) < 0.9


def test_a_straight_way_keeps_its_waypoints() -> None:
    straight = timed(FREE, GOAL)
    np.testing.assert_array_equal(repaired(FREE, [straight])[0], straight)


def test_what_collides_keeps_its_waypoints() -> None:
    into_the_table = np.linspace(ROBOT.home, ROBOT.home + np.array([0, 0.8, 0.4, 0, 0, 0]), 30)
    assert problem_of(ROBOT, TABLE, into_the_table, TIMING) != ""
    assert repaired_trajectory(ROBOT, TABLE, into_the_table, TIMING, 0) is into_the_table


def test_what_cannot_be_timed_keeps_its_waypoints(monkeypatch: pytest.MonkeyPatch) -> None:
    stored = detoured(0)
    failed = Timed(stored[:0], 0.0, "", "stops: collides")
    monkeypatch.setattr(repair_module, "time_path", lambda *_: failed)
    assert repaired_trajectory(ROBOT, FREE, stored, TIMING, 0) is stored


def test_the_whole_pool_is_kept_and_repeats_itself() -> None:
    stored = [detoured(seed % 2) for seed in range(6)]
    selection = select_repair(FREE, stored)
    assert selection.ids == [f"c{row:03d}" for row in range(6)]
    assert selection.budget is None
    assert selection.kept.equals(select_repair(FREE, stored).kept)


def test_equal_trajectories_are_repaired_once(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[np.ndarray] = []

    def count(robot: object, scene: object, q: np.ndarray, timing: object, seed: int) -> np.ndarray:
        calls.append(q)
        return q

    monkeypatch.setattr(repair_module, "repaired_trajectory", count)
    assert len(repaired(FREE, [detoured(seed % 2) for seed in range(6)])) == 6
    assert len(calls) == 2


def test_a_repair_does_not_depend_on_what_else_is_in_the_pool() -> None:
    stored = planned_around_the_table()
    alone = repaired(TABLE, stored[-1:])[0]
    np.testing.assert_array_equal(repaired(TABLE, stored)[-1], alone)


def test_repairs_are_timed_as_the_study_times_its_paths() -> None:
    stored = [detoured(0)]
    slow = replace(LEARNING, timing=TimingSettings(limit_share=0.4))
    usual, slower = select_repair(FREE, stored), select_repair(FREE, stored, learning=slow)
    assert usual.selection_id != slower.selection_id
    waypoints = [len(selection.kept["q"][0]) for selection in (usual, slower)]
    assert waypoints[1] > 1.4 * waypoints[0]
    fast = replace(LEARNING, training=TrainSettings(steps=7))
    assert select_repair(FREE, stored, learning=fast).selection_id == usual.selection_id
