"""What is free, that a state has one answer however it is asked for, and which arguments are refused."""

from __future__ import annotations

import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plancurate import native

SPHERE, CAPSULE, CYLINDER, BOX = range(4)
seeds = st.integers(0, 2**32 - 1)


@given(seed=seeds, margin=st.floats(0.0, 0.2))
@settings(deadline=None, max_examples=40)
def test_a_margin_refuses_what_is_nearer(build, seed, margin):
    rng = np.random.default_rng(seed)
    robot, _, joints = build.random_world(rng)
    q = build.random_states(rng, joints, 64)
    obstacles = [(BOX, build.random_pose(rng, 0.8), (0.1, 0.1, 0.1))]
    clearance = native.clearance(robot, build.make_scene(obstacles, margin=margin), q)
    free = native.is_free(robot, build.make_scene(obstacles, margin=margin), q)
    assert np.all(clearance[free] > margin - 1e-4)
    assert not np.any(free & (clearance <= 0))
    assert np.all(free[clearance > margin + 1e-3])


@given(seed=seeds)
@settings(deadline=None, max_examples=40)
def test_shapes_of_one_link_get_together_the_answer_that_each_gets_alone(build, seed):
    rng = np.random.default_rng(seed)
    joints, frames = build.random_joints(rng, 3), [1] * 5 + [3] * 5
    shapes = [
        (kind, build.random_pose(rng, 0.3), build.random_size(rng, kind)) for kind in rng.integers(4, size=10)
    ]
    shapes = [(kind, pose, np.multiply(size, 0.3)) for kind, pose, size in shapes]
    obstacles = [(BOX, build.random_pose(rng, 1.0), (0.1, 0.2, 0.3)) for _ in range(3)]
    scene = build.make_scene(obstacles, ground=-0.6, margin=0.01)
    pairs = [(i, j) for i in range(5) for j in range(5, 10)]
    q = build.random_states(rng, joints, 64)

    def answers(**checked):
        robot = native.Robot(**build.robot_arrays(joints=joints, shapes=shapes, frames=frames, **checked))
        return native.is_free(robot, scene, q), native.clearance(robot, scene, q)

    free, clearance = answers(pairs=pairs, scene_shapes=range(10))
    alone = [answers(pairs=[pair]) for pair in pairs] + [answers(scene_shapes=[i]) for i in range(10)]
    np.testing.assert_array_equal(free, np.all([each for each, _ in alone], axis=0))
    nearest = np.min([each for _, each in alone], axis=0)
    np.testing.assert_allclose(np.maximum(clearance, 0), np.maximum(nearest, 0), atol=2e-5)


@given(seed=seeds, count=st.integers(1, 19), points=st.integers(1, 6), most=st.sampled_from([0.0, 0.3, 9.0]))
@settings(deadline=None, max_examples=80)
def test_clearance_along_ways_is_the_smallest_of_their_points_bit_for_bit(build, seed, count, points, most):
    rng = np.random.default_rng(seed)
    robot, _, joints = build.random_world(rng)
    obstacles = [
        (kind, build.random_pose(rng, 1.0), build.random_size(rng, kind)) for kind in rng.integers(4, size=6)
    ]
    scene = build.make_scene(obstacles, ground=-0.6)
    ways = build.random_states(rng, joints, count * points).reshape(count, points, -1)
    each = native.clearance(robot, scene, ways.reshape(count * points, -1)).reshape(count, points)
    expected = np.clip(each.min(axis=1), 0, np.float32(most))
    np.testing.assert_array_equal(native.way_clearance(robot, scene, ways, most), expected)


@pytest.mark.parametrize(
    ("ways", "most", "said"),
    [(np.zeros((2, 3)), 1.0, "ways has shape"), (np.full((1, 2, 2), np.nan), 1.0, "row 0, joint 0"),
     (np.zeros((1, 2, 2)), -1.0, "most must be"), (np.zeros((1, 2, 2)), np.nan, "most must be")],
)  # fmt: skip
def test_ways_that_are_none_are_refused(build, ways, most, said):
    joints = build.random_joints(np.random.default_rng(0), 2)
    robot, scene = native.Robot(**build.robot_arrays(joints=joints)), build.make_scene([])
    with pytest.raises(ValueError, match=said):
        native.way_clearance(robot, scene, ways, most)


def test_shapes_that_touch_exactly_are_not_free(build):
    box = (BOX, np.eye(4), (0.1, 0.1, 0.1))
    robot, scene = build.free_body(box), build.make_scene([box])
    q = np.zeros((3, 6))
    q[:, 0] = [0.2, 0.2001, 0.0]
    np.testing.assert_array_equal(native.is_free(robot, scene, q), [False, True, False])


def test_a_robot_with_nothing_to_check_is_free_and_infinitely_clear(build):
    robot = native.Robot(**build.robot_arrays(joints=[(np.eye(4), (0, 0, 1), False)]))
    scene = build.make_scene([(SPHERE, np.eye(4), (1, 0, 0))], ground=10.0)
    q = np.zeros((3, 1))
    assert native.is_free(robot, scene, q).all()
    assert np.isinf(native.clearance(robot, scene, q)).all()


def test_shapes_without_extent_are_points(build):
    robot = build.free_body((SPHERE, np.eye(4), (0, 0, 0)))
    scene = build.make_scene([(BOX, np.eye(4), (0, 0, 0))])
    q = np.zeros((2, 6))
    q[1, 0] = 0.01
    np.testing.assert_array_equal(native.is_free(robot, scene, q), [False, True])


@given(seed=seeds, count=st.integers(0, 40))
@settings(deadline=None, max_examples=40)
def test_a_state_has_one_answer_in_any_batch_and_order(build, seed, count):
    rng = np.random.default_rng(seed)
    robot, scene, joints = build.random_world(rng)
    q = build.random_states(rng, joints, count)
    order = rng.permutation(count)
    for ask in (native.is_free, native.clearance):
        together = ask(robot, scene, q)
        np.testing.assert_array_equal(ask(robot, scene, q[order]), together[order])
        np.testing.assert_array_equal([ask(robot, scene, row[None])[0] for row in q], together)


@given(seed=seeds, resolution=st.floats(0.005, 2.0))
@settings(deadline=None, max_examples=60)
def test_an_edge_is_free_exactly_when_all_its_states_are(build, seed, resolution):
    rng = np.random.default_rng(seed)
    robot, scene, joints = build.random_world(rng)
    q0 = build.random_states(rng, joints, 12)
    q1 = q0 + rng.uniform(-1, 1, (12, 1)) * (build.random_states(rng, joints, 12) - q0)
    expected = []
    for start, end in zip(q0, q1, strict=True):
        steps = int(np.ceil(np.abs(end - start).max() / resolution))
        t = (np.arange(steps + 1) / max(steps, 1))[:, None]
        expected.append(native.is_free(robot, scene, (1 - t) * start + t * end).all())
    np.testing.assert_array_equal(native.edge_is_free(robot, scene, q0, q1, resolution), expected)


def test_an_edge_without_length_is_its_state(build):
    robot, scene, joints = build.random_world(np.random.default_rng(3))
    q = build.random_states(np.random.default_rng(4), joints, 200)
    free = native.is_free(robot, scene, q)
    assert 0 < free.sum() < 200
    np.testing.assert_array_equal(native.edge_is_free(robot, scene, q, q, 0.1), free)


def test_eight_threads_get_the_same_answers(build):
    worlds = [build.random_world(np.random.default_rng(seed)) for seed in range(8)]
    states = [build.random_states(np.random.default_rng(9), joints, 5_000) for _, _, joints in worlds]

    def answers(index):
        robot, scene, _ = worlds[index]
        q = states[index]
        edges = native.edge_is_free(robot, scene, q[:500], q[500:1000], 0.05)
        return np.concatenate([native.is_free(robot, scene, q), edges, native.clearance(robot, scene, q)])

    alone = [answers(index) for index in range(8)]
    with ThreadPoolExecutor(8) as pool:
        together = list(pool.map(answers, list(range(8)) * 4))
    for index, answer in enumerate(together):
        np.testing.assert_array_equal(answer, alone[index % 8])


def test_other_threads_run_while_edges_are_checked(build):
    robot, scene = build.free_body((SPHERE, np.eye(4), (0.1, 0, 0))), build.make_scene()
    q0, q1 = np.zeros((4, 6)), np.ones((4, 6))
    started, ended = threading.Event(), threading.Event()

    def check():
        started.set()
        native.edge_is_free(robot, scene, q0, q1, 1e-6)
        ended.set()

    thread = threading.Thread(target=check)
    thread.start()
    started.wait()
    ticks = 0
    while not ended.is_set():
        time.sleep(0.001)
        ticks += 1
    thread.join()
    assert ticks > 5


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"shape_kinds": np.array([0, 7], np.int32)},
            r"shape 1: its kind is 7, must be 0 \(sphere\), 1 \(capsule\)",
        ),
        ({"shape_frames": np.array([0, 9], np.int32)}, "shape 1: its frame is 9, must be from 0 to 2 - 1"),
        ({"shape_frames": np.array([0], np.int32)}, r"shape_frames has shape \(1,\), must be \(2,\)"),
        ({"shape_poses": np.zeros((2, 3, 3))}, r"shape_poses has shape \(2, 3, 3\), must be \(2, 4, 4\)"),
        ({"shape_poses": np.zeros((2, 4, 4))}, "shape 0: its pose must hold a right-handed rotation"),
        (
            {"shape_sizes": np.array([[1.0, 0, 0], [-1, 0, 0]])},
            "shape 1: its size must be finite and not negative",
        ),
        ({"shape_sizes": np.full((2, 3), np.nan)}, "shape 0: its size must be finite"),
        ({"pairs": np.array([[0, 2]], np.int32)}, "pair 0: its shape is 2, must be from 0 to 2 - 1"),
        ({"pairs": np.array([[1, 1]], np.int32)}, "pair 0: a shape cannot be checked against itself"),
        ({"pairs": np.array([0, 1], np.int32)}, r"pairs has shape \(2,\), must be \(any, 2\)"),
        ({"scene_shapes": np.array([-1], np.int32)}, "scene_shapes: a shape is -1"),
    ],
)
def test_malformed_shapes_of_a_robot_are_refused_with_the_reason(build, change, message):
    ball = (SPHERE, np.eye(4), (0.1, 0, 0))
    arrays = build.robot_arrays(joints=[(np.eye(4), (0, 0, 1), False)], shapes=[ball, ball], frames=[0, 1])
    with pytest.raises(ValueError, match=message):
        native.Robot(**(arrays | change))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"margin": -0.1}, "margin must be finite and not negative"),
        ({"margin": np.nan}, "margin must be finite"),
        ({"ground": np.inf}, "ground must be a finite height or None"),
        ({"shapes": [(5, np.eye(4), (1, 1, 1))]}, "shape 0: its kind is 5"),
    ],
)
def test_a_malformed_scene_is_refused_with_the_reason(build, settings, message):
    with pytest.raises(ValueError, match=message):
        build.make_scene(**settings)


def test_malformed_edges_are_refused_with_the_reason(build):
    robot, scene, _ = build.random_world(np.random.default_rng(0))
    q = np.zeros((2, 6))
    with pytest.raises(ValueError, match=r"q1 has shape \(1, 6\), must be \(2, 6\)"):
        native.edge_is_free(robot, scene, q, q[:1], 0.1)
    with pytest.raises(ValueError, match="q1: row 0, joint 2 is not finite"):
        native.edge_is_free(robot, scene, q, np.where(np.arange(6) == 2, np.nan, q), 0.1)
    for resolution in (0.0, -1.0, 1e-9, np.nan, np.inf):
        with pytest.raises(ValueError, match="resolution must be finite and at least 1e-6"):
            native.edge_is_free(robot, scene, q, q, resolution)
