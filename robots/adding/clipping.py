"""Cut triangles by a plane."""

from __future__ import annotations

import numpy as np

from plancurate.robots.shapes import FloatArray


def side_points(triangles: FloatArray, normal: FloatArray, offset: float) -> FloatArray:
    """The corners (n,3) of what `clip` returns."""
    height = triangles @ normal - offset
    return np.concatenate([triangles[height >= 0], _crossings(triangles, height)])


def _crossings(triangles: FloatArray, height: FloatArray) -> FloatArray:
    """Where the triangles' edges cross the plane (n,3)."""
    points = []
    for a, b in ((0, 1), (1, 2), (2, 0)):
        cross = height[:, a] * height[:, b] < 0
        share = height[cross, a] / (height[cross, a] - height[cross, b])
        points.append(triangles[cross, a] + share[:, None] * (triangles[cross, b] - triangles[cross, a]))
    return np.concatenate(points)


def clip(triangles: FloatArray, normal: FloatArray, offset: float) -> FloatArray:
    """Triangles (n,3,3) that cover what of the surface has a product with `normal` above `offset`."""
    height = triangles @ normal - offset
    above = (height >= 0).sum(axis=1)
    parts = [triangles[above == 3]]
    for count in (1, 2):
        chosen, heights = triangles[above == count], height[above == count]
        odd = ((heights >= 0) if count == 1 else (heights < 0)).argmax(axis=1)  # the corner alone on its side
        rows = np.arange(len(chosen))
        tip, left, right = (chosen[rows, (odd + k) % 3] for k in range(3))
        at_tip, at_left, at_right = (heights[rows, (odd + k) % 3][:, None] for k in range(3))
        to_left = tip + at_tip / (at_tip - at_left) * (left - tip)
        to_right = tip + at_tip / (at_tip - at_right) * (right - tip)
        if count == 1:
            parts.append(np.stack([tip, to_left, to_right], axis=1))
        else:
            parts += [np.stack([left, right, to_left], axis=1), np.stack([right, to_right, to_left], axis=1)]
    return np.concatenate(parts)
