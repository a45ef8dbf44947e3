"""Large pools are clustered cell by cell, as small ones are point by point."""

import numpy as np
import pytest

from plancurate.tasks.curation.selectors import clusters
from plancurate.tasks.curation.selectors.cells import at_most, gathered, spread_out

from .test_selectors import HYBRIDS, made_up_pool, run

LIMITS = ("_MOST_POINTS_AND_MEANS", "_MOST_NEIGHBOURS", "_MOST_FOR_HIERARCHY")


def some_points(count=500):
    rng = np.random.default_rng(0)
    return rng.uniform(-1, 1, (count, 3)), rng.uniform(0.5, 3, count)


@pytest.mark.parametrize("name", HYBRIDS)
@pytest.mark.parametrize("spread", [1e-7, 1e-4])
def test_a_large_pool_is_curated_as_a_small_one_is(name, spread, monkeypatch):
    pool = made_up_pool(5, 40, 12, spread)
    small = run(name, pool, 3)
    for limit in LIMITS:
        monkeypatch.setattr(clusters, limit, 0)
    monkeypatch.setattr(clusters, "_TARGETS_AT_ONCE", 7)
    assert run(name, pool, 3).ids == small.ids


def test_small_pools_know_no_cells(monkeypatch):
    def no_cells(*_):
        raise AssertionError("a small pool was gathered in cells")

    monkeypatch.setattr(clusters, "_kmeans_of_cells", no_cells)
    monkeypatch.setattr(clusters, "at_most", no_cells)
    for name in ("KMeans_Hybrid", "Hierarchical_Hybrid"):
        run(name, made_up_pool(1, 5, 9), 2)


def test_cells_hold_near_points_and_all_their_weight():
    points, weight = some_points()
    cells = gathered(points, weight, 0.3)
    assert len(np.unique(cells.of_point)) == len(cells.centre) < len(points)
    assert cells.weight.sum() == pytest.approx(weight.sum())
    for cell in range(len(cells.centre)):
        mine = cells.of_point == cell
        assert np.ptp(points[mine], axis=0).max() <= 0.3
        np.testing.assert_allclose(cells.centre[cell], np.average(points[mine], axis=0, weights=weight[mine]))


def test_cells_grow_until_they_are_few_enough():
    points, weight = some_points()
    assert len(gathered(points, weight, 0.1).centre) > 60
    few = at_most(points, weight, 0.1, 60)
    assert 8 <= len(few.centre) <= 60
    assert len(at_most(points, weight, 0.1, 500).centre) == len(gathered(points, weight, 0.1).centre)


def test_starts_of_kmeans_are_spread_over_the_groups():
    rng = np.random.default_rng(0)
    places = rng.uniform(-1, 1, (30, 3))
    points = np.repeat(places, 5, axis=0) + rng.normal(0, 1e-7, (150, 3))
    drawn = spread_out(points, np.ones(150), 30, np.random.RandomState(0))
    assert sorted(drawn // 5) == list(range(30))
    weight = np.where(np.arange(150) == 7, 1.0, 0.0) + 1e-12
    assert spread_out(points, weight, 1, np.random.RandomState(1)) == [7]


def test_pairs_of_neighbours_are_counted_in_cells():
    points, weight = some_points(60)
    cells = gathered(np.repeat(points, 3, axis=0), np.repeat(weight, 3), 1e-6)
    apart = np.linalg.norm(points[:, None] - points, axis=2)
    assert cells.pairs_within(0.5) == 9 * (apart <= 0.5).sum()
