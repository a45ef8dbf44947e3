import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from plancurate.tasks.candidates.metrics import joint_movement, path_length, smoothness

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
