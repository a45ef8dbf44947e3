from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.robots import Robot, load_robot, load_scene
from plancurate.tasks.learning.demonstrations import Demonstrations, demonstrations, seen_along
from plancurate.tasks.learning.settings import BASIC_OBSERVATION, TrainSettings

SCENE = load_scene("free")


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("h2017")


def line(robot: Robot, steps: int, reach: float) -> np.ndarray:
    """A straight joint path (steps, n) from home."""
    return robot.home + np.linspace(0, reach, steps)[:, None] * np.linspace(1, -1, robot.dof)


def tool(robot: Robot, q: np.ndarray) -> np.ndarray:
    return native.fk(robot.native, q)[:, :3, 3]


def test_steps_show_what_is_seen_and_lead_along_the_trajectory(robot: Robot) -> None:
    paths = [line(robot, 8, 0.3), line(robot, 5, -0.2)]
    targets = np.stack([tool(robot, path)[-1] for path in paths])
    data = demonstrations(robot, SCENE, paths, targets, hold_steps=3)
    assert data.lengths.tolist() == [11, 8]
    assert data.starts.tolist() == [0, 11]
    for path, target, start in zip(paths, targets, data.starts, strict=True):
        steps = slice(start, start + len(path) - 1)
        np.testing.assert_allclose(data.observations[steps, 3:], path[:-1], atol=1e-6)
        np.testing.assert_allclose(data.observations[steps, :3], (target - tool(robot, path))[:-1], atol=1e-6)
        np.testing.assert_allclose(data.actions[steps], np.diff(path, axis=0), atol=1e-7)


def test_demonstration_ends_in_held_steps_at_the_target(robot: Robot) -> None:
    path = line(robot, 8, 0.3)
    data = demonstrations(robot, SCENE, [path], tool(robot, path)[-1:], hold_steps=4)
    held = slice(7, None)
    assert len(data.observations[held]) == 5
    assert not data.actions[held].any()
    np.testing.assert_allclose(data.observations[held, :3], 0, atol=1e-6)
    np.testing.assert_allclose(data.observations[held, 3:] - path[-1], 0, atol=1e-6)


@pytest.mark.parametrize("steps", ["time", "arc"])
def test_what_is_seen_along_a_trajectory_does_not_depend_on_the_others(robot: Robot, steps: str) -> None:
    settings = TrainSettings(
        demonstration_steps=steps, observation=(*BASIC_OBSERVATION, "clearances_by_detours")
    )
    paths = [line(robot, 8, 0.3), line(robot, 5, -0.2), line(robot, 30, 0.7)]
    targets = np.stack([tool(robot, path)[-1] for path in paths])
    data = demonstrations(robot, SCENE, paths, targets, settings)
    seen = [
        *seen_along(robot, SCENE, paths[:1], targets[:1], settings),
        *seen_along(robot, SCENE, paths[1:], targets[1:], settings),
    ]
    assert [len(one) for one in seen] == data.lengths.tolist()
    np.testing.assert_array_equal(np.concatenate(seen), data.observations)
    again = demonstrations(robot, SCENE, paths, targets, settings, seen=seen)
    np.testing.assert_array_equal(again.observations, data.observations)


def test_nothing_kept_is_an_error_in_one_line(robot: Robot) -> None:
    with pytest.raises(PlancurateError, match="0 trajectories were kept"):
        demonstrations(robot, SCENE, [], np.empty((0, 3)))


@given(st.lists(st.integers(1, 12), min_size=1, max_size=6), st.integers(1, 15))
def test_windows_stay_in_their_episode_and_repeat_its_last_step(lengths: list[int], window: int) -> None:
    starts = np.concatenate([[0], np.cumsum(lengths)[:-1]]).astype(np.int64)
    total = sum(lengths)
    data = Demonstrations(
        layout=(("made_up", 4),),
        observations=np.zeros((total, 4), np.float32),
        q=np.zeros((total, 1), np.float32),
        actions=np.zeros((total, 1), np.float32),
        starts=starts,
        lengths=np.array(lengths),
    )
    assert data.window_starts.tolist() == list(range(total))
    rows = data.windows(data.window_starts, window)
    episode = np.repeat(np.arange(len(lengths)), lengths)
    for first, row in enumerate(rows):
        steps_left = int(starts[episode[first]] + lengths[episode[first]] - first)
        inside = list(range(first, first + steps_left))
        assert row.tolist() == (inside + [inside[-1]] * window)[:window]


def test_windows_begin_at_the_kept_waypoints_and_while_holding_if_the_last_is_kept(robot: Robot) -> None:
    paths = [line(robot, 4, 0.3), line(robot, 3, -0.2), line(robot, 2, 0.1)]
    kept = [np.array([1, 3]), np.array([0]), None]
    weights = np.array([1.0, 2.0, 0.5])
    data = demonstrations(robot, SCENE, paths, np.zeros((3, 3)), hold_steps=2, steps=kept, weights=weights)
    assert data.window_starts.tolist() == [1, 3, 4, 5, 6, 11, 12, 13, 14]
    assert data.window_weights is not None
    assert data.window_weights.tolist() == [1, 1, 1, 1, 2, 0.5, 0.5, 0.5, 0.5]


def test_keeping_no_step_at_all_is_an_error(robot: Robot) -> None:
    with pytest.raises(PlancurateError, match="no step"):
        demonstrations(
            robot, SCENE, [line(robot, 4, 0.3)], np.zeros((1, 3)), steps=[np.array([], dtype=np.int64)]
        )
