import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from plancurate.tasks.candidates.motions import (
    Pace,
    grid_of,
    spline_samples,
    stopping_samples,
    straight_samples,
    subdivided,
)

VELOCITY = np.array([1.7453, 1.3963, 1.7453, 3.14, 3.14, 3.14])
PACE = Pace(VELOCITY, VELOCITY.copy(), 0.05)
FOREVER = 10**9

configurations = arrays(float, 6, elements=st.floats(-3, 3, allow_subnormal=False))


def paths(low: int, high: int) -> st.SearchStrategy[np.ndarray]:
    return st.integers(low, high).flatmap(
        lambda w: arrays(float, (w, 6), elements=st.floats(-3, 3, width=32))
    )


def distinct(path: np.ndarray) -> bool:
    return bool(np.all(np.linalg.norm(np.diff(path, axis=0), axis=1) > 1e-4))


def test_a_slow_joint_moves_as_in_the_textbook():
    # 1 rad at 1 rad/s and 1 rad/s^2: 1 s to full speed, which is half of the way, and 1 s to stop
    pace = Pace(np.ones(1), np.ones(1), 0.25)
    q = straight_samples(np.zeros(1), np.ones(1), pace)
    t = np.arange(9) * 0.25
    np.testing.assert_allclose(q[:, 0], np.where(t < 1, t**2 / 2, 1 - (2 - t) ** 2 / 2), atol=1e-12)


def test_a_long_way_is_cruised_at_full_speed():
    pace = Pace(np.full(1, 2.0), np.full(1, 4.0), 0.5)
    q = straight_samples(np.zeros(1), np.full(1, 5.0), pace)
    np.testing.assert_allclose(q[:, 0], [0, 0.5, 1.5, 2.5, 3.5, 4.5, 5])


@given(configurations, configurations)
def test_straight_motions_keep_the_limits_and_meet_their_ends(a, b):
    q = straight_samples(a, b, PACE)
    assert np.array_equal(q[0], a)
    assert np.array_equal(q[-1], b)
    assert PACE.excess(q) <= 1 + 1e-9


@given(paths(2, 6))
def test_stopping_motions_pass_every_waypoint(path):
    q = stopping_samples(path, PACE)
    assert PACE.excess(q) <= 1 + 1e-9
    for waypoint in path:
        assert np.abs(q - waypoint).max(axis=1).min() == 0


@pytest.mark.slow
@settings(deadline=None)  # the first call imports toppra
@given(paths(3, 8).filter(distinct))
def test_spline_motions_keep_the_limits_between_grid_points_too(path):
    q = spline_samples(path, PACE, FOREVER)
    if len(q):  # toppra may find nothing where a spline turns on the spot
        assert np.array_equal(q[[0, -1]], path[[0, -1]])
        assert PACE.excess(q) <= 1 + 1e-6


def test_a_spline_is_faster_than_stopping_and_is_given_up_where_it_is_not():
    path = np.array([np.zeros(6), np.full(6, 0.5), np.linspace(0.8, 1.2, 6)])
    stopping = stopping_samples(path, PACE)
    q = spline_samples(path, PACE, len(stopping))
    assert 0 < len(q) < 0.8 * len(stopping)
    assert len(spline_samples(path, PACE, len(q) - 1)) == 0


def test_a_finer_grid_hardly_shortens_a_motion(monkeypatch):
    path = np.random.default_rng(0).uniform(-1, 1, (5, 6))
    coarse = len(spline_samples(path, PACE, FOREVER))
    monkeypatch.setattr("plancurate.tasks.candidates.motions.GRID_POINTS", 2000)
    assert len(spline_samples(path, PACE, FOREVER)) >= 0.96 * coarse


@given(paths(2, 6).filter(distinct))
def test_the_grid_holds_every_knot_once(path):
    knots = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    grid = grid_of(knots)
    assert np.all(np.diff(grid) > 0)
    assert np.isin(knots, grid).all()


@given(paths(2, 5).filter(distinct), st.floats(0.05, 1))
def test_a_subdivided_path_is_the_same_polyline(path, spacing):
    points = subdivided(path, spacing)
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert np.all(lengths <= spacing * (1 + 1e-9))
    assert lengths.sum() == pytest.approx(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
    assert all((points == waypoint).all(axis=1).any() for waypoint in path)


@pytest.mark.parametrize("factor", [0.5, 1.0, 3.0])
def test_excess_tells_how_much_slower_a_motion_must_be(factor):
    t = np.arange(0, 2 + 1e-9, 0.05)[:, None]
    q = np.concatenate([np.zeros((3, 1)), factor * t, np.full((3, 1), 2 * factor)])
    assert Pace(np.ones(1), np.full(1, 1e9), 0.05).excess(q) == pytest.approx(factor)


def test_standing_still_is_one_step():
    q = straight_samples(np.ones(6), np.ones(6), PACE)
    assert np.array_equal(q, np.ones((2, 6)))
