"""Demonstrations of several scenes as one data set."""

from __future__ import annotations

import numpy as np
import pytest

from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.robots import Robot, Scene, load_robot, load_scene
from plancurate.tasks.learning.demonstrations import Demonstrations, demonstrations
from plancurate.tasks.learning.join import join_demonstrations
from plancurate.tasks.learning.settings import TrainSettings

TERMS = TrainSettings(observation=("joint_positions", "goal_offset", "clearances_around"))


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("h2017")


def shown(robot: Robot, scene: Scene, *lengths: int, weights: list[float] | None = None) -> Demonstrations:
    paths = [robot.home + np.linspace(0, 0.05 * m, m)[:, None] * np.ones(robot.dof) for m in lengths]
    ends = native.fk(robot.native, np.stack([path[-1] for path in paths]))[:, :3, 3]
    given = None if weights is None else np.array(weights)
    return demonstrations(robot, scene, paths, ends, TERMS, hold_steps=2, weights=given)


def test_steps_episodes_windows_weights_and_goals_of_all_scenes_are_joined(robot: Robot) -> None:
    free, clutter = load_scene("free"), load_scene("clutter:7", robot)
    first, second = shown(robot, free, 4, 6), shown(robot, clutter, 5, weights=[3.0])
    data = join_demonstrations([first, second])
    assert data.lengths.tolist() == [6, 8, 7]
    assert data.starts.tolist() == [0, 6, 14]
    assert data.window_starts.tolist() == list(range(21))
    assert data.window_weights is not None
    assert data.window_weights.tolist() == [1.0] * 14 + [3.0] * 7
    for name in ("observations", "q", "actions"):
        np.testing.assert_array_equal(getattr(data, name)[:14], getattr(first, name))
        np.testing.assert_array_equal(getattr(data, name)[14:], getattr(second, name))
    assert data.goals is not None
    assert first.goals is not None
    assert len(data.goals.positions) == 3
    np.testing.assert_array_equal(data.goals.configurations[:2], first.goals.configurations)
    assert data.windows(np.array([12, 19]), 4).tolist() == [[12, 13, 13, 13], [19, 20, 20, 20]]
    assert join_demonstrations([first, first]).window_weights is None


def test_what_cannot_be_joined_is_refused_in_one_line(robot: Robot) -> None:
    scene = load_scene("free")
    path = robot.home + np.zeros((3, robot.dof))
    other = demonstrations(robot, scene, [path], np.zeros((1, 3)))
    with pytest.raises(PlancurateError, match="can't be joined; make all with the same terms"):
        join_demonstrations([shown(robot, scene, 4), other])
    with pytest.raises(PlancurateError, match="no data set to join"):
        join_demonstrations([])
