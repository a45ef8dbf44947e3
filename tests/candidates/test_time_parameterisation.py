from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from plancurate import native
from plancurate.robots import Robot, Scene, load_robot, load_scene
from plancurate.tasks.candidates.limits import POSITION_TOLERANCE
from plancurate.tasks.candidates.motions import Pace
from plancurate.tasks.candidates.settings import TimingSettings
from plancurate.tasks.candidates.time_parameterisation import time_path, without_repeats

ROBOT = load_robot("h2017")
FREE = load_scene("free")
SETTINGS = TimingSettings()
CORNER = ROBOT.home + np.array([0.8, -0.6, 0.3, 0, 0, 0])
BEHIND_IT = CORNER + np.array([0.8, 0.6, -0.3, 0, 0.3, 0])
AROUND_A_CORNER = np.stack([ROBOT.home, CORNER, BEHIND_IT])


def rounded(q: np.ndarray) -> np.ndarray:
    return q.astype(np.float32).astype(np.float64)


def scene_with_sphere(position: np.ndarray, radius: float) -> Scene:
    pose = np.eye(4)
    pose[:3, 3] = position
    model = native.Scene(
        shape_kinds=np.zeros(1, np.int32),
        shape_poses=pose[None],
        shape_sizes=np.array([[radius, 0.0, 0.0]]),
        ground=None,
        margin=0.0,
    )
    return replace(FREE, native=model)


def tools(q: np.ndarray) -> np.ndarray:
    return native.fk(ROBOT.native, q)[:, :3, 3]


@settings(deadline=None, max_examples=60)
@given(st.integers(1, 6).flatmap(lambda w: arrays(float, (w, 6), elements=st.floats(-1, 1, width=32))))
def test_what_is_stored_is_free_within_limits_and_meets_the_ends(unit_path):
    path = np.ascontiguousarray(ROBOT.home + unit_path * [1, 0.6, 0.7, 1, 0.7, 1])
    timed = time_path(ROBOT, FREE, path, SETTINGS)
    if timed.reason:
        assert timed.reason.split("; ")[-1] in ("stops: collides", "straight: collides")
        return
    assert np.array_equal(timed.q, rounded(timed.q))
    assert np.array_equal(timed.q[[0, -1]], rounded(path[[0, -1]]))
    assert np.all(timed.q >= ROBOT.lower - POSITION_TOLERANCE)
    assert np.all(timed.q <= ROBOT.upper + POSITION_TOLERANCE)
    assert Pace(ROBOT.velocity, ROBOT.acceleration, SETTINGS.dt).excess(timed.q) <= 1
    assert native.edge_is_free(ROBOT.native, FREE.native, timed.q[:-1], timed.q[1:], 0.01).all()
    assert timed.duration == pytest.approx((len(timed.q) - 1) * SETTINGS.dt)


def test_two_waypoints_are_a_straight_motion():
    timed = time_path(ROBOT, FREE, AROUND_A_CORNER[:2], SETTINGS)
    assert timed.method == "straight"
    direction = (CORNER - ROBOT.home) / np.linalg.norm(CORNER - ROBOT.home)
    aside = timed.q - ROBOT.home - np.outer((timed.q - ROBOT.home) @ direction, direction)
    assert np.abs(aside).max() < 1e-6


def test_corners_are_rounded_where_there_is_room():
    assert time_path(ROBOT, FREE, AROUND_A_CORNER, SETTINGS).method == "spline"


# A spline through these goes past the corner: by 0.04 rad in the first joint, 0.15 rad in the second.
OVERSHOOTING = ROBOT.home + np.array([[0.0, 0, 0, 0, 0, 0], [1.2, 0, 0, 0, 0, 0], [1.2, -0.6, 0, 0, 0, 0]])


@pytest.mark.parametrize(("ahead", "method"), [(0.6, "spline"), (0.33, "dense"), (0.2, "stops")])
def test_a_spline_that_would_collide_gives_way_to_one_nearer_to_the_path(ahead, method):
    behind_the_corner = OVERSHOOTING[1] + np.array([ahead, 0, 0, 0, 0, 0])
    scene = scene_with_sphere(tools(behind_the_corner[None])[0], 0.01)
    timed = time_path(ROBOT, scene, OVERSHOOTING, SETTINGS)
    assert timed.method == method
    assert native.edge_is_free(ROBOT.native, scene.native, timed.q[:-1], timed.q[1:], 0.01).all()


@pytest.mark.parametrize(("room", "method"), [(0.2, "spline"), (0.05, "dense"), (0.001, "stops")])
def test_a_spline_that_would_leave_the_limits_gives_way_too(room, method):
    tight = replace(ROBOT, upper=ROBOT.upper.copy())
    tight.upper[1] = ROBOT.home[1] + room
    assert time_path(tight, FREE, OVERSHOOTING, SETTINGS).method == method


def test_a_corner_at_a_joint_limit_is_passed_with_a_stop():
    home, at_limit, end = ROBOT.home, ROBOT.home.copy(), ROBOT.home.copy()
    at_limit[0] = ROBOT.upper[0]
    end[0], end[3] = ROBOT.upper[0] - 0.05, 1.0
    timed = time_path(ROBOT, FREE, np.stack([home, at_limit, end]), SETTINGS)
    assert timed.method == "stops"
    assert (timed.q == rounded(at_limit)).all(axis=1).any()


def test_a_path_through_an_obstacle_fails_with_the_reason_of_each_way():
    scene = scene_with_sphere(tools(CORNER[None])[0], 0.05)
    timed = time_path(ROBOT, scene, AROUND_A_CORNER, SETTINGS)
    assert timed.q.shape == (0, 6)
    assert timed.reason.startswith("spline: ")
    assert timed.reason.endswith("; stops: collides")


@pytest.mark.parametrize("repeats", [1, 2, 5])
def test_a_path_that_goes_nowhere_is_held_for_one_step(repeats):
    timed = time_path(ROBOT, FREE, np.repeat(ROBOT.home[None], repeats, axis=0), SETTINGS)
    assert np.array_equal(timed.q, rounded(np.repeat(ROBOT.home[None], 2, axis=0)))
    assert timed.duration == SETTINGS.dt


def test_repeated_waypoints_change_nothing():
    doubled = np.repeat(AROUND_A_CORNER, 3, axis=0)
    assert np.array_equal(without_repeats(doubled), AROUND_A_CORNER)
    timed, same = (time_path(ROBOT, FREE, path, SETTINGS) for path in (doubled, AROUND_A_CORNER))
    assert np.array_equal(timed.q, same.q)


def test_ends_survive_however_close_they_are():
    path = np.stack([ROBOT.home, ROBOT.home + 1e-6, ROBOT.home + 2e-6])
    assert np.array_equal(without_repeats(path), path[[0, 2]])


def test_a_slower_robot_takes_longer():
    def duration(robot: Robot) -> float:
        return time_path(robot, FREE, AROUND_A_CORNER, SETTINGS).duration

    slow = replace(ROBOT, velocity=ROBOT.velocity / 2, acceleration=ROBOT.acceleration / 4)
    assert duration(slow) == pytest.approx(2 * duration(ROBOT), abs=2 * SETTINGS.dt)


def test_toppra_says_nothing(caplog, capfd):
    zigzag = ROBOT.home + np.array([[0.0], [0.3], [0.0], [0.3], [0.01]]) * np.ones(6)
    time_path(ROBOT, FREE, zigzag, SETTINGS)
    assert not caplog.records
    assert capfd.readouterr() == ("", "")
