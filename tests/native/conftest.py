"""Robots and scenes made of a few numbers, for tests of the kernel alone."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from plancurate import native

SPHERE, CAPSULE, CYLINDER, BOX = range(4)


def pose(xyz=(0.0, 0.0, 0.0), rotation=None):
    matrix = np.eye(4)
    matrix[:3, :3] = np.eye(3) if rotation is None else rotation.as_matrix()
    matrix[:3, 3] = xyz
    return matrix


def random_pose(rng, reach):
    return pose(rng.uniform(-reach, reach, 3), Rotation.random(random_state=rng))


def random_size(rng, kind):
    a, b, c = rng.uniform(0.03, 0.3, 3)
    return [(a, 0, 0), (a, b, 0), (a, b, 0), (a, b, c)][kind]


def shape_arrays(shapes):
    """Rows of (kind, pose, size) as the kernel's three arrays."""
    return {
        "shape_kinds": np.array([kind for kind, _, _ in shapes], np.int32),
        "shape_poses": np.array([pose for _, pose, _ in shapes], float).reshape(-1, 4, 4),
        "shape_sizes": np.array([size for _, _, size in shapes], float).reshape(-1, 3),
    }


def robot_arrays(*, joints, shapes=(), frames=(), pairs=(), scene_shapes=(), tool=None):
    """Arguments of native.Robot from joints (origin, axis, prismatic) and shapes (kind, pose, size)."""
    return {
        "origins": np.array([origin for origin, _, _ in joints], float).reshape(-1, 4, 4),
        "axes": np.array([axis for _, axis, _ in joints], float).reshape(-1, 3),
        "prismatic": np.array([prismatic for _, _, prismatic in joints], bool),
        "tool": np.eye(4) if tool is None else tool,
        "lower": np.full(len(joints), -1.0),
        "upper": np.full(len(joints), 1.0),
        "shape_frames": np.array(frames, np.int32),
        "pairs": np.array(pairs, np.int32).reshape(-1, 2),
        "scene_shapes": np.array(scene_shapes, np.int32),
    } | shape_arrays(shapes)


def random_joints(rng, count):
    axes = Rotation.random(count, random_state=rng).apply([0, 0, 1])
    return [(random_pose(rng, 0.4), axis, bool(rng.uniform() < 0.3)) for axis in axes]


def random_states(rng, joints, count):
    spans = [0.3 if prismatic else np.pi for _, _, prismatic in joints]
    return rng.uniform(-1, 1, (count, len(joints))) * spans


def make_scene(shapes=(), ground=None, margin=0.0):
    return native.Scene(**shape_arrays(shapes), ground=ground, margin=margin)


def free_body(shape, other=None, tool=None):
    """A shape that six joints carry anywhere, three slides and three turns; the other stands at the base."""
    joints = [(np.eye(4), axis, i < 3) for i, axis in enumerate(np.tile(np.eye(3), (2, 1)))]
    if other is None:
        checked = {"shapes": [shape], "frames": [6], "scene_shapes": [0]}
    else:
        checked = {"shapes": [shape, other], "frames": [6, 0], "pairs": [(0, 1)]}
    return native.Robot(**robot_arrays(joints=joints, tool=tool, **checked))


def body_states(rng, count, reach=0.6):
    return np.hstack([rng.uniform(-reach, reach, (count, 3)), rng.uniform(-np.pi, np.pi, (count, 3))])


def random_world(rng):
    """An arm of six joints with a shape of any kind on each frame, and eight obstacles about it."""
    joints = random_joints(rng, 6)
    kinds = rng.permutation([0, 1, 2, 3, 1, 2, 3])
    shapes = [(kind, random_pose(rng, 0.1), np.multiply(random_size(rng, kind), 0.4)) for kind in kinds]
    pairs = [(i, j) for i in range(7) for j in range(i + 2, 7)]
    arrays = robot_arrays(
        joints=joints, shapes=shapes, frames=range(7), pairs=pairs, scene_shapes=range(1, 7)
    )
    obstacles = [(i % 4, random_pose(rng, 1.2), random_size(rng, i % 4)) for i in range(8)]
    return native.Robot(**arrays), make_scene(obstacles, ground=-0.8), joints


@pytest.fixture(scope="session")
def build() -> SimpleNamespace:
    """The functions above, for test modules that cannot import this one."""
    functions: list[Callable[..., object]] = [
        pose, random_pose, random_size, robot_arrays, random_joints, random_states, make_scene, random_world,
        free_body, body_states,
    ]  # fmt: skip
    return SimpleNamespace(**{function.__name__: function for function in functions})
