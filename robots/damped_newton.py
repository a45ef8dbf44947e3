"""Damped Newton iterations on a tool pose or position, many starts at once."""

from __future__ import annotations

import numpy as np

from plancurate import native
from plancurate.robots.robot import Robot
from plancurate.robots.shapes import BoolArray, FloatArray

ITERATIONS = 60  # a start that converges takes 10 to 20
ACCURACY = 1e-9  # m and rad; a tool error below counts as none
DAMPING = 1e-2  # of the squared error, so that the last steps are Newton's own
LONGEST_STEP = 0.8  # rad or m a joint; larger ones leave the region where the Jacobian holds


def tool_jacobian(robot: Robot, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Tool poses (b,4,4) and geometric Jacobians (b,6,n), translation above rotation, at states `q` (b,n)."""
    frames = native.joint_frames(robot.native, q)
    tool = native.fk(robot.native, q)
    axes = np.einsum("bnij,nj->bni", frames[:, :, :3, :3], robot.chain.axes)
    sliding = robot.chain.prismatic[None, :, None]
    arms = tool[:, None, :3, 3] - frames[:, :, :3, 3]
    linear = np.where(sliding, axes, np.cross(axes, arms))
    angular = np.where(sliding, 0.0, axes)
    return tool, np.concatenate([linear, angular], axis=2).transpose(0, 2, 1)


def converge(
    robot: Robot,
    q: FloatArray,
    position: FloatArray,
    rotation: FloatArray | None,
    axes: FloatArray | None = None,
) -> FloatArray:
    """Those of the starts `q` (b,n) that reach the target of `newton`, there (c,n)."""
    q, reached = newton(robot, q, position, rotation, axes)
    return q[reached]


def newton(
    robot: Robot,
    q: FloatArray,
    position: FloatArray,
    rotation: FloatArray | None = None,
    axes: FloatArray | None = None,
) -> tuple[FloatArray, BoolArray]:
    """Lead the starts `q` (b,n) towards the target, limits aside: where they end (b,n), and which (b,) reach it.

    `position` (3,) or one a start (b,3), in m, and `rotation` (3,3) describe the tool in the base frame; without a
    rotation `axes` (b,3), one a start, say where its z axis points, and without these it turns freely.
    """
    q, going, reached = q.copy(), np.arange(len(q)), np.zeros(len(q), dtype=bool)
    position = np.broadcast_to(position, (len(q), 3))
    for _ in range(ITERATIONS):
        tool, jacobian = tool_jacobian(robot, q[going])
        error = position[going] - tool[:, :3, 3]
        if rotation is not None:
            turn = _rotation_vector(rotation @ tool[:, :3, :3].transpose(0, 2, 1))
            error = np.concatenate([error, turn], axis=1)
        elif axes is not None:
            error = np.concatenate([error, _tilt(tool[:, :3, 2], axes[going])], axis=1)
            jacobian = _without_spin(jacobian, tool[:, :3, 2])
        else:
            jacobian = jacobian[:, :3]
        there = np.linalg.norm(error, axis=1) < ACCURACY
        reached[going[there]] = True
        going = going[~there]
        if not len(going):
            break
        q[going] += _step(jacobian[~there], error[~there])
    return q, reached


def _step(jacobian: FloatArray, error: FloatArray) -> FloatArray:
    """Levenberg-Marquardt steps (b,n), damped by the squared error and shortened to LONGEST_STEP."""
    damping = DAMPING * np.minimum((error**2).sum(axis=1), 1.0) + 1e-12
    normal = jacobian.transpose(0, 2, 1) @ jacobian + damping[:, None, None] * np.eye(jacobian.shape[2])
    step = np.linalg.solve(normal, jacobian.transpose(0, 2, 1) @ error[:, :, None])[:, :, 0]
    longest = np.abs(step).max(axis=1, keepdims=True)
    return np.asarray(step * np.minimum(1.0, LONGEST_STEP / np.maximum(longest, LONGEST_STEP)))


def _tilt(z: FloatArray, axes: FloatArray) -> FloatArray:
    """Smallest turns (b,3), axis times angle, that bring the unit vectors `z` (b,3) onto `axes` (b,3)."""
    sine_axis = np.cross(z, axes)
    sine = np.linalg.norm(sine_axis, axis=1)
    scale = np.where(sine > 1e-12, np.arctan2(sine, (z * axes).sum(axis=1)) / np.maximum(sine, 1e-12), 1.0)
    return np.asarray(sine_axis * scale[:, None])


def _without_spin(jacobian: FloatArray, z: FloatArray) -> FloatArray:
    """Take the turn about the tool's own axis `z` (b,3) out of the Jacobians (b,6,n)."""
    angular = jacobian[:, 3:]
    spin = np.einsum("bi,bin->bn", z, angular)
    return np.concatenate([jacobian[:, :3], angular - z[:, :, None] * spin[:, None]], axis=1)


def _rotation_vector(rotation: FloatArray) -> FloatArray:
    """Axis times angle (b,3) of rotation matrices (b,3,3); at half a turn, where the axis is lost, zero."""
    sine_axis = 0.5 * np.stack(
        [
            rotation[:, 2, 1] - rotation[:, 1, 2],
            rotation[:, 0, 2] - rotation[:, 2, 0],
            rotation[:, 1, 0] - rotation[:, 0, 1],
        ],
        axis=1,
    )
    sine = np.linalg.norm(sine_axis, axis=1)
    cosine = 0.5 * (np.trace(rotation, axis1=1, axis2=2) - 1.0)
    scale = np.where(sine > 1e-12, np.arctan2(sine, cosine) / np.maximum(sine, 1e-12), 1.0)
    return np.asarray(sine_axis * scale[:, None])
