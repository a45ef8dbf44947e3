"""How well primitives enclose a link's triangles: what they leave out, and how far they stick out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from plancurate.robots.shapes import FloatArray, Shape

SAMPLES = 20_000  # points of a surface


@dataclass(frozen=True)
class FitQuality:
    """Share of a link's surface inside its primitives; how far they stick out in the mean and at most, m."""

    link: str
    kinds: tuple[str, ...]
    coverage: float
    mean_protrusion: float
    most_protrusion: float


def fit_quality(link: str, triangles: FloatArray, shapes: Sequence[Shape]) -> FitQuality:
    """Measure primitives against the triangles (t,3,3) of a link, in its frame."""
    rng = np.random.default_rng(0)
    surface = sample_surface(triangles, SAMPLES, rng)
    points = np.concatenate([surface, triangles.reshape(-1, 3)])
    covered = np.any([depth(shape, points) >= 0 for shape in shapes], axis=0)
    outside = np.concatenate([_outer_points(shapes, index, rng) for index in range(len(shapes))])
    distances = cKDTree(points).query(outside)[0]
    kinds = tuple(shape.kind for shape in shapes)
    return FitQuality(link, kinds, float(covered.mean()), float(distances.mean()), float(distances.max()))


def sample_surface(triangles: FloatArray, count: int, rng: np.random.Generator) -> FloatArray:
    """Points (count,3) spread evenly over the triangles (t,3,3)."""
    sides = triangles[:, 1:] - triangles[:, :1]
    areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) + 1e-18
    chosen = rng.choice(len(triangles), count, p=areas / areas.sum())
    shares = rng.dirichlet(np.ones(3), count)
    return np.asarray((shares[:, :, None] * triangles[chosen]).sum(axis=1))


def depth(shape: Shape, points: FloatArray) -> FloatArray:
    """How deep points (n,3) lie in a primitive, m; negative outside."""
    x, y, z = ((points - shape.pose[:3, 3]) @ shape.pose[:3, :3]).T  # by columns: many times faster
    radius, half, _ = shape.size
    if shape.kind == "box":
        a, b, c = shape.size
        return np.asarray(np.minimum(np.minimum(a - np.abs(x), b - np.abs(y)), c - np.abs(z)))
    if shape.kind == "cylinder":
        return np.asarray(np.minimum(radius - np.sqrt(x * x + y * y), half - np.abs(z)))
    if shape.kind == "capsule":
        z = z - np.clip(z, -half, half)
    return np.asarray(radius - np.sqrt(x * x + y * y + z * z))


def _outer_points(shapes: Sequence[Shape], index: int, rng: np.random.Generator) -> FloatArray:
    """Points (n,3) of the surface of one primitive that lie in none of the others."""
    shape = shapes[index]
    points = boundary(shape, rng, SAMPLES // 10)
    inside = np.zeros(len(points), dtype=bool)
    for other in (*shapes[:index], *shapes[index + 1 :]):
        inside |= depth(other, points) > 0
    return points[~inside]


def boundary(shape: Shape, rng: np.random.Generator, count: int) -> FloatArray:
    """Points (count,3) of a primitive's surface: where rays from inside leave it, corners included."""
    rays = rng.normal(size=(count, 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    a, b, c = shape.size
    if shape.kind == "box":
        local = rays / np.abs(rays / np.array([a, b, c])).max(axis=1, keepdims=True)
        local[:8] = np.array(np.meshgrid([-a, a], [-b, b], [-c, c])).reshape(3, -1).T
    elif shape.kind == "cylinder":
        scale = np.maximum(np.linalg.norm(rays[:, :2], axis=1) / a, np.abs(rays[:, 2]) / b)
        local = rays / scale[:, None]
    else:
        local = a * rays
        if shape.kind == "capsule":
            local[:, 2] += b * np.sign(local[:, 2])  # its caps
            local[::2, 2] = rng.uniform(-b, b, len(local[::2]))  # and its side
            local[::2, :2] *= a / np.linalg.norm(local[::2, :2], axis=1, keepdims=True)
    return np.asarray(local @ shape.pose[:3, :3].T + shape.pose[:3, 3])
