from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from plancurate.robots import load_robot, load_scene
from plancurate.tasks.candidates.metrics import joint_movement, min_clearance, path_length, smoothness

points = arrays(float, 3, elements=st.floats(-2, 2))
configurations = arrays(float, 6, elements=st.floats(-3, 3))


@given(points, points, st.integers(2, 40))
def test_a_straight_line_is_as_long_as_its_ends_are_apart(a, b, count):
    assert path_length(np.linspace(a, b, count)) == pytest.approx(np.linalg.norm(b - a), abs=1e-9)


@given(points, points, st.integers(3, 40), st.floats(0.01, 1))
def test_constant_cartesian_velocity_is_perfectly_smooth(a, b, count, dt):
    assert smoothness(np.linspace(a, b, count), dt) * dt**2 == pytest.approx(0, abs=1e-12)


@given(
    arrays(float, 6, elements=st.floats(-3, 3)),
    arrays(float, 6, elements=st.floats(-3, 3)),
    st.integers(2, 50),
)
def test_joint_movement_does_not_depend_on_the_sampling_of_a_straight_path(a, b, count):
    assert joint_movement(np.linspace(a, b, count)) == pytest.approx(np.abs(b - a).sum(), abs=1e-9)


@given(arrays(float, (5, 3), elements=st.floats(-2, 2)))
def test_a_detour_never_shortens_a_path(tool):
    assert path_length(tool) >= path_length(tool[[0, 4]]) - 1e-12
    assert path_length(np.concatenate([tool, tool[::-1]])) == pytest.approx(2 * path_length(tool))


def test_constant_acceleration_adds_up_over_the_inner_samples():
    t = np.arange(11) * 0.1
    tool = np.stack([3 * t**2 / 2, np.zeros(11), 4 * t**2 / 2], axis=1)  # 5 m/s^2
    assert smoothness(tool, 0.1) == pytest.approx(9 * 5)


def test_back_and_forth_counts_twice():
    assert joint_movement(np.array([[0.0, 0], [1, -1], [0, 0]])) == 4


def test_a_single_sample_has_gone_nowhere():
    assert (
        joint_movement(np.zeros((1, 6)))
        == path_length(np.zeros((1, 3)))
        == smoothness(np.zeros((1, 3)), 0.05)
        == 0
    )


def ball(folder: Path, radius: float) -> object:
    """A scene of one ball beside the way of the arm that turns about its foot."""
    file = folder / "ball.yaml"
    file.write_text(
        f"ground: null\nshapes: [{{name: ball, kind: sphere, radius: {radius}, xyz: [0.9, 0.9, 1.3]}}]\n"
    )
    return load_scene(file)


def test_clearance_is_that_of_the_nearest_moment_also_between_samples(tmp_path):
    robot = load_robot("h2017")
    swing = robot.home + np.outer([0.0, 0.785, 1.57], [1, 0, 0, 0, 0, 0])
    small, large = (min_clearance(robot, ball(tmp_path, radius), swing[::2]) for radius in (0.1, 0.15))
    assert large == pytest.approx(small - 0.05, abs=1e-4)
    scene = ball(tmp_path, 0.1)
    at_samples = min(min_clearance(robot, scene, q[None]) for q in swing[::2])
    assert small < at_samples - 0.15
    moments = np.linspace(swing[0], swing[2], 300)
    assert small == pytest.approx(min(min_clearance(robot, scene, q[None]) for q in moments), abs=1e-3)


def test_the_floor_is_kept_clear_of_and_the_arm_itself_does_not_count(tmp_path):
    robot = load_robot("h2017")
    upright = np.zeros((1, 6))
    assert min_clearance(robot, load_scene("free"), upright) > 0.05
    nothing = tmp_path / "nothing.yaml"
    nothing.write_text("ground: null\n")
    assert min_clearance(robot, load_scene(nothing), upright) is None
