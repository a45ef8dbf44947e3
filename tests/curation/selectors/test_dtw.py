from __future__ import annotations

import time
from collections.abc import Sequence

import duckdb
import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plancurate import native
from plancurate.robots import load_robot, load_scene
from plancurate.tasks.curation.pool import Pool, make_pool
from plancurate.tasks.curation.selectors.base import Problem, Stopwatch
from plancurate.tasks.curation.selectors.dtw import (
    POINTS,
    of_largest_groups,
    pairwise_dtw,
    tool_path_groups,
    tool_shape,
)
from plancurate.tasks.curation.selectors.selection import Selection, select

from .defects import LEARNING

ROBOT, SCENE = load_robot("h2017"), load_scene("free")
PARTITION = {"robot": "h2017", "scene": "free", "pool": "0a1b2c"}
NAMES = ("DTW", "DTW_Hybrid")
Paths = list[tuple[int, np.ndarray]]  # target and waypoints of each candidate


def reference_dtw(a: np.ndarray, b: np.ndarray) -> float:
    """The textbook's dynamic programme in double precision."""
    table = np.full((len(a) + 1, len(b) + 1), np.inf)
    table[0, 0] = 0
    for i, p in enumerate(a):
        for j, q in enumerate(b):
            before = min(table[i, j], table[i, j + 1], table[i + 1, j])
            table[i + 1, j + 1] = np.linalg.norm(p - q) + before
    return float(table[-1, -1])


def distance(a: np.ndarray, b: np.ndarray) -> float:
    return float(pairwise_dtw(np.stack([a, b]).astype(np.float32))[0])


def on_a_line(*x: float) -> np.ndarray:
    return np.column_stack([x, np.zeros(len(x)), np.zeros(len(x))])


def moved(*offset: float) -> np.ndarray:
    """Home, but for the first joints."""
    return ROBOT.home + np.pad(offset, (0, ROBOT.dof - len(offset)))


def swing(*corners: np.ndarray, samples: int = 40) -> np.ndarray:
    """Waypoints from home over joint positions, `samples` in all, evenly."""
    path = np.array([ROBOT.home, *corners])
    at = np.linspace(0, len(corners), samples)
    return np.column_stack([np.interp(at, np.arange(len(path)), joint) for joint in path.T])


def pool_of(paths: Paths, seed: int = 0) -> Pool:
    """A pool of these trajectories; a target lies where its first one ends."""
    rng = np.random.default_rng(seed)
    tool = np.array([native.fk(ROBOT.native, q[-1:])[0, :3, 3] for _, q in paths])
    target = np.array([number for number, _ in paths])
    n = len(paths)
    columns = {
        "trajectory_id": [f"c{row:04d}" for row in range(n)], "target_id": pa.array(target, pa.int32()),
        "planner": ["RRT"] * n, "run": pa.array(np.arange(n), pa.int32()),
        "goal_index": pa.array(np.zeros(n), pa.int32()),
        "joint_movement": rng.random(n), "smoothness": rng.random(n), "path_length": rng.random(n),
        "tool_x": tool[:, 0], "tool_y": tool[:, 1], "tool_z": tool[:, 2], "duration": rng.random(n),
        "final_distance": rng.random(n), "n_waypoints": pa.array([len(q) for _, q in paths], pa.int32()),
        "dt": np.full(n, 0.05), "multiplicity": np.ones(n, dtype=np.int64),
    }  # fmt: skip
    numbers = sorted(set(target.tolist()))
    places = tool[[target.tolist().index(number) for number in numbers]]
    targets = pa.table(
        {"target_id": pa.array(numbers, pa.int32()), **dict(zip("xyz", places.T, strict=True))}
    )
    return make_pool(PARTITION, pa.table(columns), targets)


def problem_of(paths: Paths, budget: int = 1) -> Problem:
    def waypoints(ids: Sequence[str]) -> list[np.ndarray]:
        return [paths[int(name[1:])][1] for name in ids]

    watch, connection, pool = Stopwatch(time.perf_counter), duckdb.connect(), pool_of(paths)
    connection.register("candidates", pool.candidates.append_column("row", pa.array(np.arange(len(paths)))))
    return Problem(pool, budget, 0, connection, watch, ROBOT, SCENE, waypoints, LEARNING)


def run(name: str, paths: Paths, budget: int, seed: int = 0, pool: Pool | None = None) -> Selection:
    read = problem_of(paths).waypoints
    pool = pool or pool_of(paths)
    return select(name, pool, budget, seed, robot=ROBOT, scene=SCENE, waypoints=read, learning=LEARNING)


def made_up_paths(targets: int, per_target: int) -> Paths:
    """Three shapes of way to each target, with some noise on the way; the goals are the same."""
    rng = np.random.default_rng(targets)
    paths = []
    for target in range(targets):
        goal = ROBOT.home + rng.uniform(-0.6, 0.6, ROBOT.dof)
        for number in range(per_target):
            via = ROBOT.home + [0, 1.0, -1.0][number % 3] + rng.normal(0, 0.01, ROBOT.dof)
            paths.append((target, swing(via, goal)))
    return paths


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 12), st.integers(2, 6))
def test_distances_are_the_textbooks(seed: int, points: int, paths: int) -> None:
    walks = np.random.default_rng(seed).normal(size=(paths, points, 3)).cumsum(axis=1).astype(np.float32)
    expected = [reference_dtw(walks[i], walks[j]) for i in range(paths) for j in range(i + 1, paths)]
    np.testing.assert_allclose(pairwise_dtw(walks), expected, rtol=1e-5)


def test_distances_worked_out_by_hand() -> None:
    assert distance(on_a_line(0, 1, 2), on_a_line(0, 2, 2)) == 1  # point 1 is 1 away from 0 and from 2
    assert distance(on_a_line(0, 1, 2), on_a_line(1, 1, 1)) == 2
    assert distance(on_a_line(0, 3, 0), on_a_line(0, 0, 0)) == 3
    assert distance(on_a_line(0, 1, 2), on_a_line(2, 1, 0)) == 4


def test_waiting_on_the_way_costs_nothing() -> None:
    assert distance(on_a_line(0, 1, 5, 5, 5), on_a_line(0, 0, 0, 1, 5)) == 0


def test_tool_shapes_do_not_depend_on_speed() -> None:
    slow = swing(ROBOT.home + 0.5, moved(0.9, 0.1, -0.3), samples=200)
    hasty = slow[np.unique(np.round(199 * np.linspace(0, 1, 120) ** 2).astype(int))]
    waiting = np.concatenate([slow[:50], np.repeat(slow[50:51], 30, axis=0), slow[50:]])
    shape = tool_shape(ROBOT, slow)
    assert shape.shape == (POINTS, 3)
    steps = np.linalg.norm(np.diff(shape, axis=0), axis=1)
    assert steps.max() < 1.1 * steps[:10].mean()
    for other in (hasty, waiting):
        np.testing.assert_allclose(tool_shape(ROBOT, other), shape, atol=2e-3)


def test_a_tool_that_stands_still_has_a_shape() -> None:
    tool = native.fk(ROBOT.native, ROBOT.home[None])[0, :3, 3]
    np.testing.assert_allclose(tool_shape(ROBOT, np.array([ROBOT.home] * 2)), np.tile(tool, (POINTS, 1)))


def test_each_target_has_its_own_groups_of_paths_over_and_under() -> None:
    goals = [moved(0.5), moved(-0.7)]
    rng = np.random.default_rng(0)
    paths, over = [], []
    for row in range(30):
        way = 0.8 if row % 3 else -0.8  # of the second joint: twice as often over as under
        goal = goals[row % 2]
        via = (ROBOT.home + goal) / 2 + [0, way, 0, 0, 0, 0] + rng.normal(0, 0.02, 6)
        paths.append((row % 2, swing(via, goal, samples=int(rng.integers(20, 80)))))
        over.append(row % 3 > 0)
    problem = problem_of(paths)
    rows = [int(name[1:]) for name in problem.pool.candidates["trajectory_id"].to_pylist()]
    expected = [2 * (row % 2) + (not over[row]) for row in rows]  # the larger group of a target comes first
    assert tool_path_groups(problem, 2).tolist() == expected


def test_a_target_with_one_path_is_one_group() -> None:
    path = swing(ROBOT.home + 0.3)
    assert tool_path_groups(problem_of([(0, path), (1, path), (1, path)]), 2).tolist() == [0, 2, 2]


def test_the_lowest_keys_of_the_first_group_come_first_then_those_of_the_next() -> None:
    paths = [(target, swing(moved(0.3 * target))) for target in range(2) for _ in range(5)]
    key = np.array([5.0, 4.0, 3.0, 2.0, 1.0] * 2)
    kept = of_largest_groups(problem_of(paths, budget=4), np.array([0, 0, 0, 1, 1, 2, 2, 3, 2, 2]), key)
    assert kept.rows.tolist() == [2, 1, 0, 4, 9, 8, 6, 5]
    assert kept.cluster is not None
    assert kept.cluster.tolist() == [0, 0, 0, 1, 2, 2, 2, 2]


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("budget", [1, 4, 9])
def test_k_times_targets_are_kept_each_once_and_again(name: str, budget: int) -> None:
    paths = made_up_paths(4, 9)
    selection = run(name, paths, budget, seed=3)
    assert len(set(selection.ids)) == len(selection.ids) == 4 * budget
    assert run(name, paths, budget, seed=3).kept.equals(selection.kept)
    assert selection.kept["cluster"].null_count == 0
    assert (selection.kept["score"].null_count == 0) == (name == "DTW_Hybrid")
    assert selection.seconds["cluster"] > 0


@pytest.mark.parametrize("name", NAMES)
def test_the_order_of_rows_does_not_matter(name: str) -> None:
    paths = made_up_paths(3, 6)
    pool = pool_of(paths)
    rows = np.random.default_rng(0).permutation(len(paths))
    other = make_pool(PARTITION, pool.candidates.take(rows), pool.targets)
    assert run(name, paths, 2, pool=other).kept.equals(run(name, paths, 2, pool=pool).kept)


def test_seeds_draw_different_ones_and_the_hybrid_the_same() -> None:
    paths = made_up_paths(3, 12)
    assert run("DTW", paths, 2, seed=0).ids != run("DTW", paths, 2, seed=1).ids
    assert run("DTW_Hybrid", paths, 2, seed=0).ids == run("DTW_Hybrid", paths, 2, seed=1).ids


@pytest.mark.parametrize("name", NAMES)
def test_a_budget_beyond_a_target_keeps_all_there_are(name: str) -> None:
    assert len(run(name, made_up_paths(2, 3), 4).ids) == 6
