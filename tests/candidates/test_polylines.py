from __future__ import annotations

import numpy as np

from plancurate.tasks.candidates import polylines
from plancurate.tasks.candidates.polylines import evenly, evenly_each, path_length, travelled

CORNER = np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 5.0]])


def test_lengths_by_hand() -> None:
    assert path_length(CORNER) == 6.0
    assert travelled(CORNER).tolist() == [0.0, 5.0, 6.0]
    assert path_length(CORNER[:1]) == 0.0


def test_points_are_as_far_from_each_other_along_the_line() -> None:
    assert np.allclose(evenly(CORNER, 3), [[0.0, 0.0], [1.8, 2.4], [3.0, 5.0]])
    assert np.allclose(evenly(CORNER, 2), CORNER[[0, -1]])


def test_many_polylines_at_once_are_those_of_one_after_another_to_the_last_bit(monkeypatch):
    monkeypatch.setattr(polylines, "AT_ONCE", 3)
    rng = np.random.default_rng(0)
    paths = [rng.normal(size=(length, 6)).cumsum(axis=0) for length in [2, 9, 40, 9, 9, 2, 9, 9]]
    paths[1][4] = paths[1][3]  # a point that is there twice
    paths[3][:] = paths[3][0]  # a polyline that goes nowhere
    for path, found in zip(paths, evenly_each(paths, 48), strict=True):
        along = travelled(path)
        wanted = np.linspace(0.0, along[-1], 48)
        assert np.array_equal(found, np.stack([np.interp(wanted, along, axis) for axis in path.T], axis=1))
