"""What lies around a link: points outside it, which a primitive of it should not reach to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial import ConvexHull, QhullError, cKDTree

from plancurate.robots.adding.clipping import clip
from plancurate.robots.adding.quality import depth, sample_surface
from plancurate.robots.shapes import BoolArray, FloatArray, Shape

POINTS, SLICES = 2000, 10
MARGIN = 0.25  # of the link's extent, that the points lie around it
SURFACE = 8000


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Points (p,3) outside a link in its frame, and the distance (p,) of each to its surface, m."""

    points: FloatArray
    distances: FloatArray
    surface: cKDTree

    def reached(self, shape: Shape) -> BoolArray:
        """Which points (p,) lie in a primitive."""
        return np.asarray(depth(shape, self.points) > 0)

    def excess(self, reached: BoolArray) -> float:
        """How far what is `reached` (p,) sticks out of the link: the sum of the points' distances, m."""
        return float(self.distances[reached].sum())

    def union(self, shapes: Sequence[Shape]) -> float:
        """How far several primitives stick out together."""
        return self.excess(np.any([self.reached(shape) for shape in shapes], axis=0))

    def with_points(self, points: FloatArray, excess: float) -> Surroundings:
        """These surroundings with points (n,3) more, which together count as much as `excess`, m."""
        points = np.random.default_rng(0).permutation(points)[:POINTS]
        distances = self.surface.query(points)[0]
        distances *= excess / max(float(distances.sum()), 1e-12)
        return Surroundings(
            np.concatenate([self.points, points]), np.concatenate([self.distances, distances]), self.surface
        )


def surroundings(triangles: FloatArray) -> Surroundings:
    """Draw points around the triangles (t,3,3)."""
    rng = np.random.default_rng(0)
    corners = triangles.reshape(-1, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    room = MARGIN * (high - low).max()
    points = rng.uniform(low - room, high + room, (POINTS, 3))
    points = points[~_inside(triangles, points)]
    surface = cKDTree(sample_surface(triangles, SURFACE, rng))
    return Surroundings(points, surface.query(points)[0], surface)


def _inside(triangles: FloatArray, points: FloatArray) -> BoolArray:
    """Which points lie in the convex hulls of slices along every axis: nearly the solid, hollows excepted."""
    inside = np.ones(len(points), dtype=bool)
    for axis in np.eye(3):
        along = triangles @ axis
        cuts = np.linspace(along.min(), along.max(), SLICES + 1)
        in_some = np.zeros(len(points), dtype=bool)
        for low, high in pairwise(cuts):
            part = clip(clip(triangles, axis, low), -axis, -high)
            in_some |= _in_hull(part.reshape(-1, 3), points)
        inside &= in_some
    return inside


def _in_hull(corners: FloatArray, points: FloatArray) -> BoolArray:
    try:
        planes = ConvexHull(corners).equations
    except (QhullError, ValueError):
        return np.zeros(len(points), dtype=bool)
    return np.asarray((points @ planes[:, :3].T + planes[:, 3] <= 0).all(axis=1))
