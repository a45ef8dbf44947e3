from __future__ import annotations

import numpy as np

from plancurate.tasks.candidates.polylines import evenly, path_length, travelled

CORNER = np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 5.0]])


def test_lengths_by_hand() -> None:
    assert path_length(CORNER) == 6.0
    assert travelled(CORNER).tolist() == [0.0, 5.0, 6.0]
    assert path_length(CORNER[:1]) == 0.0


def test_points_are_as_far_from_each_other_along_the_line() -> None:
    assert np.allclose(evenly(CORNER, 3), [[0.0, 0.0], [1.8, 2.4], [3.0, 5.0]])
    assert np.allclose(evenly(CORNER, 2), CORNER[[0, -1]])
