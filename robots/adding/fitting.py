"""Enclose a link's triangles in a few primitives: split where that saves most volume, as often as it pays.

The solid inside the triangles is enclosed as well: a plane splits it in two, and a half lies in the convex hull of the
surface on its side with the surface's points on the plane.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from plancurate.robots.adding.enclosing import cost, enclose, hull_points, volume
from plancurate.robots.shapes import FloatArray, Shape

SHARES = np.linspace(0.1, 0.9, 9)  # where splits are tried, of the extent along a direction
PRICE = 0.03  # share of the first shape's volume that one more shape must save


@dataclass(frozen=True, eq=False)
class Cluster:
    """Triangles (t,3,3) and the primitive that holds them."""

    triangles: FloatArray
    shape: Shape

    @property
    def slack(self) -> float:
        """Volume of the primitive that the triangles' convex hull does not fill, m3."""
        try:
            return volume(self.shape) - float(ConvexHull(self.triangles.reshape(-1, 3)).volume)
        except QhullError:
            return volume(self.shape)

    @property
    def cost(self) -> float:
        """Volume, m3."""
        return cost(self.shape)


def fit(triangles: FloatArray, most: int) -> list[Cluster]:
    """Return one to `most` clusters whose primitives hold the triangles (t,3,3) and what they enclose; none for none."""
    if not len(triangles):
        return []
    clusters = [Cluster(triangles, enclose(triangles.reshape(-1, 3)))]
    price = PRICE * clusters[0].cost
    stages = [clusters]
    splits = {0: best_split(clusters[0])}
    while len(clusters) < most and any(splits.values()):
        index = max(splits, key=lambda key: _gain(clusters[key], splits[key]))
        first, second = splits[index]
        clusters = [*clusters[:index], first, *clusters[index + 1 :], second]
        splits[index], splits[len(clusters) - 1] = best_split(first), best_split(second)
        stages.append(clusters)
    return min(stages, key=lambda stage: sum(cluster.cost for cluster in stage) + price * len(stage))


def tightened(cluster: Cluster) -> Shape:
    """The cluster's primitive, with directions tried around its own."""
    return enclose(cluster.triangles.reshape(-1, 3), refine=True)


def _gain(cluster: Cluster, halves: tuple[Cluster, ...]) -> float:
    return cluster.cost - sum(half.cost for half in halves) if halves else -np.inf


def best_split(cluster: Cluster) -> tuple[Cluster, ...]:
    """The two parts of a cluster, cut by a plane, whose primitives are least; () where no plane cuts it."""
    best: tuple[float, FloatArray, float] = (np.inf, np.zeros(3), 0.0)
    corners = cluster.triangles.reshape(-1, 3)
    for normal in _normals(corners):
        along = corners @ normal
        for offset in along.min() + SHARES * np.ptp(along):
            halves = [_side_points(cluster.triangles, sign * normal, sign * offset) for sign in (1, -1)]
            if min(len(half) for half in halves) > 3:
                total = sum(cost(enclose(half)) for half in halves)
                best = min(best, (total, normal, float(offset)), key=lambda split: split[0])
    if best[0] == np.inf:
        return ()
    parts = (clip(cluster.triangles, sign * best[1], sign * best[2]) for sign in (1, -1))
    return tuple(Cluster(part, enclose(part.reshape(-1, 3))) for part in parts)


def _normals(points: FloatArray) -> FloatArray:
    own = np.linalg.svd(hull_points(points) - points.mean(axis=0), full_matrices=False)[2]
    return np.concatenate([np.eye(3), own])


def _side_points(triangles: FloatArray, normal: FloatArray, offset: float) -> FloatArray:
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
    """The triangles (n,3,3) that cover the part of the surface where points' product with `normal` is above `offset`."""
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
