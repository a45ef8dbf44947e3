from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from plancurate.robots import load_robot, load_scene
from plancurate.tasks.learning.arc import resampled, resampled_steps
from plancurate.tasks.learning.demonstrations import demonstrations
from plancurate.tasks.learning.settings import TrainSettings

ROBOT, SCENE = load_robot("h2017"), load_scene("free")


def polyline(seed: int, waypoints: int, joints: int = 3) -> np.ndarray:
    """Waypoints (m, joints) unevenly apart, some of them twice."""
    rng = np.random.default_rng(seed)
    steps = rng.normal(size=(waypoints - 1, joints)) * rng.choice([0, 0.02, 0.2], (waypoints - 1, 1))
    return np.concatenate([np.zeros((1, joints)), np.cumsum(steps, axis=0)])


def length(q: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(q, axis=0), axis=1).sum())


def at_distance(q: np.ndarray, distance: float) -> np.ndarray:
    """The point so far along the polyline, found by walking it."""
    for start, end in pairwise(q):
        edge = float(np.linalg.norm(end - start))
        if edge > 0 and distance <= edge:
            return start + distance / edge * (end - start)
        distance -= edge
    return q[-1]


def passed_otherwise(q: np.ndarray, seed: int) -> np.ndarray:
    """The same path at another speed: further waypoints on its edges, and rests."""
    rng = np.random.default_rng(seed)
    shares = [np.sort(rng.uniform(size=rng.integers(0, 4))) for _ in q[1:]]
    edges = [
        a + np.concatenate([[0], share])[:, None] * (b - a)
        for a, b, share in zip(q, q[1:], shares, strict=False)
    ]
    dense = np.concatenate([*edges, q[-1:]])
    return np.repeat(dense, rng.integers(1, 4, len(dense)), axis=0)


PATHS = st.builds(polyline, st.integers(0, 10_000), st.integers(1, 12))
STEPS = st.floats(0.01, 0.5)


@given(PATHS, STEPS)
def test_waypoints_lie_every_step_along_the_path_and_at_both_ends(q: np.ndarray, step: float) -> None:
    found = resampled(q, step)
    np.testing.assert_array_equal(found[[0, -1]], q[[0, -1]])
    assert (len(found) - 2) * step < length(q) <= (len(found) - 1) * step + 1e-6
    for k, point in enumerate(found[:-1]):
        np.testing.assert_allclose(point, at_distance(q, k * step), atol=1e-9)


@pytest.mark.slow
@given(st.integers(0, 1000), STEPS)
def test_all_steps_of_a_straight_path_are_as_long_but_the_last(seed: int, step: float) -> None:
    end = np.random.default_rng(seed).normal(size=6)
    steps = np.linalg.norm(np.diff(resampled(np.linspace(0, 1, 7)[:, None] ** 2 * end, step), axis=0), axis=1)
    np.testing.assert_allclose(steps[:-1], step, rtol=1e-9)
    assert 0 < steps[-1] <= step * (1 + 1e-9)


@given(PATHS, STEPS, st.integers(0, 1000))
def test_how_fast_a_path_was_passed_does_not_matter(q: np.ndarray, step: float, seed: int) -> None:
    one, other = resampled(q, step), resampled(passed_otherwise(q, seed), step)
    assert abs(len(one) - len(other)) <= 1  # where the length is a multiple of the step, up to rounding
    shared = min(len(one), len(other)) - 1
    np.testing.assert_allclose(one[:shared], other[:shared], atol=1e-9)


def test_a_whole_number_of_steps_leaves_no_tiny_last_one() -> None:
    for end in (0.3, 3 * 0.1, 0.3 + 1e-12):
        found = resampled(np.array([[0.0], [0.1], [0.17], [end]]), 0.1)
        np.testing.assert_allclose(found, [[0], [0.1], [0.2], [end]], atol=1e-11)
        assert found[-1] == end
    np.testing.assert_array_equal(resampled(np.full((5, 2), 0.7), 0.1), [[0.7, 0.7]])


@given(PATHS, STEPS, st.data())
def test_named_waypoints_are_stood_for_by_those_nearest_along_the_path(
    q: np.ndarray, step: float, data: st.DataObject
) -> None:
    kept = np.array(sorted(data.draw(st.sets(st.integers(0, len(q) - 1)))), dtype=np.int64)
    found = resampled_steps(q, kept, step)
    count = len(resampled(q, step))
    assert found.tolist() == sorted(set(found.tolist()))
    assert ((found >= 0) & (found < count)).all()
    assert bool(len(found)) == bool(len(kept))
    if count > 1:
        assert (count - 1 in found) == (len(q) - 1 in kept)
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))])
    for k in kept:  # something near stands for each
        assert np.abs(found * step - along[k]).min() <= step + 1e-9
    for k in found:  # and each stands for something
        between = np.abs(along - min(k * step, along[-1]))
        assert between[kept].min() <= max(between.min(), step) + 1e-9


def test_all_waypoints_are_stood_for_by_all_and_a_stretch_by_its_stretch() -> None:
    q = np.linspace(0, 1, 41)[:, None]  # 0.025 apart
    assert resampled_steps(q, np.arange(41), 0.1).tolist() == list(range(11))
    assert resampled_steps(q, np.arange(8, 21), 0.1).tolist() == [2, 3, 4, 5]
    assert resampled_steps(q, np.arange(8, 21), 0.01).tolist() == list(range(19, 52))


def test_demonstrations_by_arc_ask_for_the_same_actions_however_fast_a_path_is_passed() -> None:
    settings = TrainSettings(demonstration_steps="arc", arc_rad=0.05)
    way = np.array([0.5, -0.3, 0.2, 0.1, 0.4, -0.2])
    slow, quick = (ROBOT.home + np.linspace(0, 1, m)[:, None] ** p * way for m, p in ((60, 2), (15, 1)))
    data = demonstrations(ROBOT, SCENE, [slow, quick], np.zeros((2, 3)), settings, hold_steps=4)
    first, second = (slice(start, start + n) for start, n in zip(data.starts, data.lengths, strict=True))
    np.testing.assert_allclose(data.observations[first], data.observations[second], atol=1e-6)
    np.testing.assert_allclose(data.actions[first], data.actions[second], atol=1e-6)
    assert data.lengths.tolist() == [int(np.ceil(np.linalg.norm(way) / 0.05)) + 1 + 4] * 2
    assert not data.actions[first][-5:].any()
    in_time = demonstrations(ROBOT, SCENE, [slow, quick], np.zeros((2, 3)), hold_steps=4)
    assert in_time.lengths.tolist() == [64, 19]


def test_windows_of_demonstrations_by_arc_begin_where_the_selection_says() -> None:
    settings = TrainSettings(demonstration_steps="arc", arc_rad=0.1)
    path = ROBOT.home + np.linspace(0, 1, 41)[:, None] * np.eye(6)[0]
    kept = [np.arange(8, 21), np.array([0, 40])]
    data = demonstrations(ROBOT, SCENE, [path] * 2, np.zeros((2, 3)), settings, hold_steps=2, steps=kept)
    assert data.lengths.tolist() == [13, 13]
    assert data.window_starts.tolist() == [2, 3, 4, 5, 13, 23, 24, 25]


@pytest.mark.parametrize("step", [0, -0.1, float("inf"), float("nan")])
def test_a_step_that_is_none_is_refused(step: float) -> None:
    with pytest.raises(ValidationError, match="arc_rad"):
        TrainSettings(arc_rad=step)
