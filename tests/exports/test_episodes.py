"""What of a pool and its selections every format is written from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.robots import Robot, Scene
from plancurate.tasks.curation.pool import FloatArray, Pool
from plancurate.tasks.curation.selectors.selection import Selection
from plancurate.tasks.exports.episodes import Episodes, make_episodes

from .conftest import POSITIONS


def test_the_whole_pool_comes_first_and_what_a_selection_made_follows(
    episodes: Episodes, waypoints: Mapping[str, FloatArray]
) -> None:
    assert episodes.about["trajectory_id"].to_pylist() == [*waypoints, "t1-r2"]
    assert episodes.about["made_by"].to_pylist() == [None] * 6 + ["Shorter"]
    assert episodes.about["joint_movement"].to_pylist() == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, None]
    assert episodes.lengths.tolist() == [*map(len, waypoints.values()), 5]


def test_frames_are_the_waypoints_and_the_step_after_each_shows_what_follows(
    episodes: Episodes, waypoints: Mapping[str, FloatArray]
) -> None:
    paths = [*waypoints.values(), waypoints["t1-r2"][::2]]
    np.testing.assert_array_equal(episodes.data.q[episodes.frames], np.float32(np.concatenate(paths)))
    following = [np.concatenate([q[1:], q[-1:]]) for q in paths]
    np.testing.assert_array_equal(episodes.data.q[episodes.frames + 1], np.float32(np.concatenate(following)))


def test_the_target_is_observed_from_the_tool(
    episodes: Episodes, world: tuple[Robot, Scene], waypoints: Mapping[str, FloatArray]
) -> None:
    robot, scene = world
    tool = native.fk(robot.native, waypoints["t1-r0"])[:, :3, 3]
    first = int(episodes.data.starts[3])
    terms = dict(episodes.terms())
    seen = terms["target_offset"][first : first + len(tool)]
    np.testing.assert_allclose(seen, POSITIONS[1] - tool, atol=1e-6)
    assert list(terms) == ["joint_positions", "target_offset", "scene_parameters"]
    assert (terms["scene_parameters"] != 0).any(axis=0).sum() > 6 * (len(scene.shapes) - 1)


def test_marks_say_what_each_selection_keeps_and_why(episodes: Episodes) -> None:
    ranked, stepwise, shorter = episodes.marks
    assert ranked.kept == [1, 5]
    assert ranked.rows["rank"].to_pylist() == [None, 1, None, None, None, 2, None]
    assert ranked.rows["score"].to_pylist() == [None, -1.0, None, None, None, -2.0, None]
    assert ranked.steps is None
    assert stepwise.rows["weight"].to_pylist() == [2.0, None, None, 1.0, None, None, None]
    assert shorter.kept == [6]


def test_a_selection_of_steps_marks_frames(episodes: Episodes) -> None:
    steps = episodes.marks[1].steps
    assert steps is not None
    by_episode = np.split(steps, np.cumsum(episodes.lengths)[:-1])
    assert np.flatnonzero(by_episode[0]).tolist() == [0, 3]
    assert by_episode[3].all()
    assert not any(by_episode[k].any() for k in (1, 2, 4, 5, 6))


def test_a_selection_of_other_candidates_is_refused(
    world: tuple[Robot, Scene], pool: Pool, selections: list[Selection]
) -> None:
    foreign = replace(selections[0], pool_hash="feedfeedfeed")
    with pytest.raises(PlancurateError, match="selection Ranked is of other candidates"):
        make_episodes(*world, pool, [selections[1], foreign], lambda ids: [], ())
