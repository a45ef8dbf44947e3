"""Distances of pairs of primitives and of the floor, against oracles that share no code with the kernel."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from plancurate import native

SPHERE, CAPSULE, CYLINDER, BOX = range(4)
KIND_PAIRS = list(itertools.combinations_with_replacement(range(4), 2))


def core_point(kind, size, pose, p):
    local = np.einsum("...ji,...j->...i", pose[..., :3, :3], p - pose[..., :3, 3])
    if kind == CYLINDER:
        off_axis = np.linalg.norm(local[..., :2], axis=-1, keepdims=True)
        local[..., :2] *= np.minimum(1, size[0] / np.maximum(off_axis, 1e-12))
        local[..., 2] = np.clip(local[..., 2], -size[1], size[1])
    else:
        half = {SPHERE: (0, 0, 0), CAPSULE: (0, 0, size[1]), BOX: size}[kind]
        local = np.clip(local, -np.array(half), half)
    return np.einsum("...ij,...j->...i", pose[..., :3, :3], local) + pose[..., :3, 3]


def rounding(kind, size):
    """Radius around the core, m."""
    return size[0] if kind in (SPHERE, CAPSULE) else 0.0


def long_run_distance(a, poses, b, steps=1500):
    """Distances of shape a at poses (b,4,4) from shape b: upper bounds that converge from above."""
    (kind_a, _, size_a), (kind_b, pose_b, size_b) = a, b
    ahead = before = poses[:, :3, 3]
    age = np.zeros((len(poses), 1))
    nearest = np.full(len(poses), np.inf)
    for _ in range(steps):
        on_b = core_point(kind_b, size_b, pose_b, ahead)
        on_a = core_point(kind_a, size_a, poses, on_b)
        nearest = np.minimum(nearest, np.linalg.norm(on_a - on_b, axis=1))
        uphill = ((ahead - on_a) * (on_a - before)).sum(axis=1, keepdims=True) > 0
        age = np.where(uphill, 0, age + 1)
        ahead, before = on_a + age / (age + 3) * (on_a - before), on_a
    return nearest - rounding(kind_a, size_a) - rounding(kind_b, size_b)


@pytest.mark.slow
@pytest.mark.parametrize(("kind_a", "kind_b"), KIND_PAIRS)
def test_clearance_is_a_tight_lower_bound_of_the_distance(build, kind_a, kind_b):
    rng = np.random.default_rng(kind_a * 4 + kind_b)
    for aligned in (True, False):
        tool, there = build.random_pose(rng, 0.1), build.random_pose(rng, 0.1)
        a, b = ((kind, at, build.random_size(rng, kind)) for kind, at in ((kind_a, tool), (kind_b, there)))
        if aligned:  # nearly parallel faces and edges are what converges worst
            b = (kind_b, np.eye(4), b[2])
            a = (kind_a, np.eye(4), a[2])
        q = build.body_states(rng, 400)
        if aligned:
            q[:, 3:] *= 1e-4
        alone, together = build.free_body(a, tool=a[1]), build.free_body(a, b)
        distance = long_run_distance(a, native.fk(alone, q), b)
        for robot, scene in ((alone, build.make_scene([b])), (together, build.make_scene())):
            clearance, free = native.clearance(robot, scene, q), native.is_free(robot, scene, q)
            assert np.all(clearance <= distance + 1e-9)
            assert not np.any(free & (distance < 0))
            assert np.all(free[distance > 1e-3])
            assert np.max((distance - clearance)[distance > 1e-3]) < 2e-3


@pytest.fixture(scope="module")
def bullet():
    from plancurate.tasks.candidates.bullet import bullet

    client = bullet.connect(bullet.DIRECT)
    yield bullet, client
    bullet.disconnect(client)


def bullet_shape(bullet, client, kind, size):
    geometry = [bullet.GEOM_SPHERE, bullet.GEOM_CAPSULE, bullet.GEOM_CYLINDER, bullet.GEOM_BOX][kind]
    sizes = {"halfExtents": list(size)} if kind == BOX else {"radius": size[0], "height": 2 * size[1]}
    return bullet.createCollisionShape(geometry, **sizes, physicsClientId=client)


def bullet_distances(bullet, client, a, poses, b):
    shapes = [bullet_shape(bullet, client, kind, size) for kind, _, size in (a, b)]
    turn_b = Rotation.from_matrix(b[1][:3, :3]).as_quat()
    distances = []
    for pose, turn in zip(poses, Rotation.from_matrix(poses[:, :3, :3]).as_quat(), strict=True):
        points = bullet.getClosestPoints(
            -1, -1, 10.0,
            collisionShapeA=shapes[0], collisionShapePositionA=pose[:3, 3], collisionShapeOrientationA=turn,
            collisionShapeB=shapes[1], collisionShapePositionB=b[1][:3, 3], collisionShapeOrientationB=turn_b,
            physicsClientId=client,
        )  # fmt: skip
        distances.append(min(point[8] for point in points))
    bullet.resetSimulation(physicsClientId=client)
    return np.array(distances)


@pytest.mark.parametrize(("kind_a", "kind_b"), KIND_PAIRS)
def test_distances_agree_with_pybullet_and_none_it_calls_deep_is_free(build, bullet, kind_a, kind_b):
    rng = np.random.default_rng(100 + kind_a * 4 + kind_b)
    for _ in range(10):
        tool, there = build.random_pose(rng, 0.1), build.random_pose(rng, 0.1)
        a, b = ((kind, at, build.random_size(rng, kind)) for kind, at in ((kind_a, tool), (kind_b, there)))
        q = build.body_states(rng, 40)
        robot, scene = build.free_body(a, tool=tool), build.make_scene([b])
        theirs = bullet_distances(*bullet, a, native.fk(robot, q), b)
        ours, free = native.clearance(robot, scene, q), native.is_free(robot, scene, q)
        assert not np.any(free & (theirs < -1e-3))
        apart = theirs > 2e-3
        assert np.all(free[apart])
        assert np.all(ours[theirs < -1e-3] <= 0)
        assert np.all(ours[apart] <= theirs[apart] + 1e-3)
        assert np.all(
            ours[apart] >= theirs[apart] - 2e-3
        )  # its boxes and cylinders are up to 1.5 mm too small


@pytest.mark.parametrize("kind", range(4))
def test_the_floor_is_met_where_the_lowest_point_says(build, kind):
    rng = np.random.default_rng(kind)
    shape = (kind, np.eye(4), build.random_size(rng, kind))
    robot = build.free_body(shape)
    q = build.body_states(rng, 500, reach=0.3)
    poses = native.fk(robot, q)
    far_below = poses[:, :3, 3] - [0, 0, 1e7]  # whose nearest point of a shape is its lowest
    lowest = core_point(kind, shape[2], poses, far_below)[:, 2] - (
        shape[2][0] if kind in (SPHERE, CAPSULE) else 0
    )
    scene = build.make_scene(ground=-0.2)
    np.testing.assert_allclose(native.clearance(robot, scene, q), lowest + 0.2, atol=1e-4)
    decided = np.abs(lowest + 0.2) > 1e-4
    np.testing.assert_array_equal(native.is_free(robot, scene, q)[decided], (lowest > -0.2)[decided])
