from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import numpy as np
import pytest

from plancurate import native

START, END = np.array([-0.8, 0, 0]), np.array([0.8, 0, 0])
RESOLUTION = 0.01


@pytest.fixture(scope="module")
def column(build):
    """A ball that slides along three axes, around a column of radius 0.3 that stands in the way."""
    joints = [(np.eye(4), axis, True) for axis in np.eye(3)]
    ball, post = (0, build.pose(), (0.1, 0, 0)), (2, build.pose(), (0.3, 0.8, 0))
    arrays = build.robot_arrays(joints=joints, shapes=[ball], frames=[3], scene_shapes=[0])
    return SimpleNamespace(robot=native.Robot(**arrays), scene=build.make_scene([post]))


def detour(seed: int, corners: int = 8) -> np.ndarray:
    """A zigzag around the column, from START to END."""
    rng = np.random.default_rng(seed)
    angle = np.linspace(np.pi, 0, corners + 2)[1:-1]
    radius, height = rng.uniform(0.6, 0.9, corners), rng.uniform(-0.5, 0.5, corners)
    around = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])
    return np.vstack([START, around, END])


def simplify(world: SimpleNamespace, path: np.ndarray, seed: int = 1) -> np.ndarray:
    return native.simplify(world.robot, world.scene, path, seed=seed, resolution=RESOLUTION)


def length(path: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def is_free(world: SimpleNamespace, path: np.ndarray) -> bool:
    return bool(native.edge_is_free(world.robot, world.scene, path[:-1], path[1:], RESOLUTION).all())


def turns(path: np.ndarray) -> np.ndarray:
    """Angles (w - 2,) by which a path turns at its waypoints."""
    step = np.diff(path, axis=0)
    step /= np.linalg.norm(step, axis=1, keepdims=True)
    return np.arccos(np.clip((step[1:] * step[:-1]).sum(axis=1), -1, 1))


def test_a_detour_gets_shorter_and_stays_free_with_the_very_same_ends(column):
    for seed in range(20):
        path = detour(seed)
        assert is_free(column, path)
        short = simplify(column, path)
        assert length(short) < 0.8 * length(path)
        assert is_free(column, short)
        assert short[[0, -1]].tobytes() == path[[0, -1]].tobytes()


def test_corners_are_rounded(column):
    sharpest = [turns(simplify(column, detour(seed))).max() for seed in range(20)]
    assert np.median([turns(detour(seed)).max() for seed in range(20)]) > 1
    assert np.median(sharpest) < 0.5


def test_a_detour_around_nothing_becomes_a_straight_line(build, column):
    empty = SimpleNamespace(robot=column.robot, scene=build.make_scene())
    np.testing.assert_array_equal(simplify(empty, detour(0)), [START, END])


@pytest.mark.parametrize("waypoints", [1, 2, 3])
def test_short_paths_stay_what_they_are(waypoints, column):
    path = detour(0)[:waypoints]
    assert length(simplify(column, path)) <= length(path)
    np.testing.assert_array_equal(simplify(column, path)[[0, -1]], path[[0, -1]])


def test_waypoints_that_repeat_are_one(column):
    path = detour(0)
    np.testing.assert_array_equal(simplify(column, path[[0, 0, 0]]), path[:1])
    assert length(simplify(column, np.repeat(path, 3, axis=0))) < length(path)


def test_depends_on_path_and_seed_alone_in_any_thread(column):
    alone = [simplify(column, detour(seed), seed).tobytes() for seed in range(30)]
    assert simplify(column, detour(0), 1).tobytes() != alone[0]
    with ThreadPoolExecutor(4) as pool:
        beside = list(pool.map(lambda seed: simplify(column, detour(seed), seed).tobytes(), range(30)))
    assert beside == alone


def test_a_path_that_is_not_free_is_an_error_that_says_where(column):
    path = detour(0)
    with pytest.raises(ValueError, match="path: edge 3 is not free"):
        simplify(column, np.vstack([path[:3], END, path[3:]]))
    with pytest.raises(ValueError, match="path: waypoint 0 is in collision"):
        simplify(column, np.zeros((1, 3)))


@pytest.mark.parametrize(
    ("path", "message"),
    [
        (np.zeros((4, 2)), r"path has shape \(4, 2\), must be \(any, 3\)"),
        (np.zeros(3), r"path has shape \(3,\)"),
        (np.empty((0, 3)), "path: at least one waypoint is needed"),
        (np.array([START, [0, np.nan, 0]]), "path: row 1, joint 1 is not finite"),
    ],
)
def test_paths_of_the_wrong_shape_are_errors(path, message, column):
    with pytest.raises(ValueError, match=message):
        simplify(column, path)


@pytest.mark.parametrize("resolution", [0.0, -1.0, np.nan])
def test_a_resolution_that_makes_no_sense_is_an_error(resolution, column):
    with pytest.raises(ValueError, match="resolution must be finite"):
        native.simplify(column.robot, column.scene, detour(0), seed=1, resolution=resolution)
