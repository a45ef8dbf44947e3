from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from plancurate import native

seeds = st.integers(0, 2**32 - 1)


def frames_by_products(joints, q):
    frame, frames = np.eye(4), []
    for (origin, axis, prismatic), value in zip(joints, q, strict=True):
        motion = np.eye(4)
        if prismatic:
            motion[:3, 3] = value * np.asarray(axis)
        else:
            motion[:3, :3] = Rotation.from_rotvec(value * np.asarray(axis)).as_matrix()
        frame = frame @ origin @ motion
        frames.append(frame)
    return np.array(frames)


@given(seed=seeds, count=st.integers(1, 9), states=st.integers(0, 20))
@settings(deadline=None, max_examples=60)
def test_frames_and_tool_agree_with_products_of_transforms(build, seed, count, states):
    rng = np.random.default_rng(seed)
    joints, tool = build.random_joints(rng, count), build.random_pose(rng, 0.2)
    robot = native.Robot(**build.robot_arrays(joints=joints, tool=tool))
    q = build.random_states(rng, joints, states)
    expected = np.array([frames_by_products(joints, row) for row in q]).reshape(-1, count, 4, 4)
    np.testing.assert_allclose(native.joint_frames(robot, q), expected, rtol=0, atol=1e-13)
    np.testing.assert_allclose(native.fk(robot, q), expected[:, -1] @ tool, rtol=0, atol=1e-13)


@pytest.mark.parametrize("axis", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0, -1, 0)])
def test_axes_along_and_against_the_frame_turn_the_right_way(build, axis):
    joints = [(np.eye(4), axis, False)]
    robot = native.Robot(**build.robot_arrays(joints=joints))
    q = np.linspace(-7, 7, 57)[:, None]
    expected = np.array([frames_by_products(joints, row)[-1] for row in q])
    np.testing.assert_allclose(native.fk(robot, q), expected, rtol=0, atol=1e-15)


def test_many_turns_lose_no_accuracy(build):
    robot = native.Robot(**build.robot_arrays(joints=[(np.eye(4), (0, 0, 1), False)]))
    q = np.random.default_rng(0).uniform(-1e5, 1e5, (10_000, 1))
    poses = native.fk(robot, q)
    np.testing.assert_allclose(poses[:, 0, 0], np.cos(q[:, 0]), rtol=0, atol=1e-15)
    np.testing.assert_allclose(poses[:, 1, 0], np.sin(q[:, 0]), rtol=0, atol=1e-15)


def test_a_pose_does_not_depend_on_its_place_in_the_batch(build):
    rng = np.random.default_rng(1)
    joints = build.random_joints(rng, 6)
    robot = native.Robot(**build.robot_arrays(joints=joints))
    q = build.random_states(rng, joints, 21)
    alone = np.concatenate([native.fk(robot, row[None]) for row in q])
    np.testing.assert_array_equal(native.fk(robot, q), alone)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"axes": np.zeros((3, 3))}, r"axes has shape \(3, 3\), must be \(2, 3\)"),
        ({"tool": np.zeros((3, 3))}, r"tool has shape \(3, 3\), must be \(4, 4\)"),
        ({"lower": np.zeros((2, 1))}, r"lower has shape \(2, 1\), must be \(2,\)"),
        ({"axes": np.array([[0, 0, 1.0], [0, 0, 2]])}, "joint 1: its axis must be a unit vector"),
        ({"axes": np.full((2, 3), np.nan)}, "joint 0: its axis must be a unit vector"),
        ({"upper": np.array([1.0, -1])}, "joint 1: its limits must be finite, lower below upper"),
        ({"lower": np.array([-np.inf, -1])}, "joint 0: its limits must be finite"),
        ({"origins": np.full((2, 4, 4), np.nan)}, "joint 0: its origin must be finite"),
        (
            {"origins": np.tile(np.diag([2.0, 1, 1, 1]), (2, 1, 1))},
            "joint 0: its origin must hold a right-handed",
        ),
        ({"tool": np.diag([1.0, 1, -1, 1])}, "tool must hold a right-handed rotation"),
        ({"tool": np.ones((4, 4))}, "tool must hold a right-handed rotation"),
    ],
)
def test_a_malformed_robot_is_refused_with_the_reason(build, change, message):
    joints = [(np.eye(4), (0, 0, 1), False)] * 2
    with pytest.raises(ValueError, match=message):
        native.Robot(**(build.robot_arrays(joints=joints) | change))


def test_a_robot_without_joints_is_refused(build):
    with pytest.raises(ValueError, match="at least one joint"):
        native.Robot(**build.robot_arrays(joints=[]))


@pytest.mark.parametrize(
    ("q", "message"),
    [
        (np.zeros((4, 3)), r"q has shape \(4, 3\), must be \(any, 2\)"),
        (np.zeros(2), r"q has shape \(2,\), must be \(any, 2\)"),
        (np.array([[0.0, 0.0], [0.0, np.inf]]), "q: row 1, joint 1 is not finite"),
    ],
)
def test_malformed_states_are_refused_with_the_reason(build, q, message):
    robot = native.Robot(**build.robot_arrays(joints=[(np.eye(4), (0, 0, 1), False)] * 2))
    with pytest.raises(ValueError, match=message):
        native.fk(robot, q)
