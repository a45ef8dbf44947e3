"""Where rays meet primitive shapes. All arrays are float32: a picture needs no more."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from plancurate.robots.shapes import Shape

Rays = NDArray[np.float32]
NEVER = np.float32(np.inf)


def distances(shape: Shape, origin: Rays, direction: Rays) -> Rays:
    """How far along each ray (m,) a shape is met first, m, infinite where never.

    Origins and unit directions are (m, 3) or (3,) in the shape's outer frame; rays begin outside the shape.
    """
    turn = shape.pose[:3, :3].astype(np.float32)
    start = (origin - shape.pose[:3, 3].astype(np.float32)) @ turn
    way = direction @ turn
    start, way = np.broadcast_arrays(np.atleast_2d(start), np.atleast_2d(way))
    a, b = np.float32(shape.size[0]), np.float32(shape.size[1])
    with np.errstate(divide="ignore", invalid="ignore"):
        if shape.kind == "box":
            return box(np.array(shape.size, dtype=np.float32), start, way)
        if shape.kind == "sphere":
            return ball(a, start, way)
        ends = capsule_ends if shape.kind == "capsule" else discs
        return np.minimum(tube(a, b, start, way), ends(a, b, start, way))


def ball(radius: np.float32, start: Rays, way: Rays) -> Rays:
    """A sphere around the origin."""
    along = dot(start, way)
    square = along**2 - dot(start, start) + radius**2
    near = -along - np.sqrt(np.maximum(square, 0))
    return np.where((square > 0) & (near > 0), near, NEVER)


def tube(radius: np.float32, half: np.float32, start: Rays, way: Rays) -> Rays:
    """The side of a cylinder along z."""
    a = way[:, 0] ** 2 + way[:, 1] ** 2
    b = start[:, 0] * way[:, 0] + start[:, 1] * way[:, 1]
    square = b**2 - a * (start[:, 0] ** 2 + start[:, 1] ** 2 - radius**2)
    near = (-b - np.sqrt(np.maximum(square, 0))) / a
    height = start[:, 2] + near * way[:, 2]
    return np.where((square > 0) & (near > 0) & (np.abs(height) <= half), near, NEVER)


def capsule_ends(radius: np.float32, half: np.float32, start: Rays, way: Rays) -> Rays:
    """The round ends of a capsule along z."""
    up = np.array([0, 0, half], dtype=np.float32)
    return np.minimum(ball(radius, start - up, way), ball(radius, start + up, way))


def discs(radius: np.float32, half: np.float32, start: Rays, way: Rays) -> Rays:
    """The flat ends of a cylinder along z."""
    near = (-np.sign(way[:, 2]) * half - start[:, 2]) / way[:, 2]
    out = (start[:, 0] + near * way[:, 0]) ** 2 + (start[:, 1] + near * way[:, 1]) ** 2
    return np.where((out <= radius**2) & (near > 0), near, NEVER)


def box(half: Rays, start: Rays, way: Rays) -> Rays:
    """A box around the origin."""
    one, other = (-half - start) / way, (half - start) / way
    near = greatest(np.minimum(one, other))
    far = -greatest(-np.maximum(one, other))
    return np.where((near <= far) & (near > 0), near, NEVER)


def normals(shape: Shape, points: Rays) -> Rays:
    """Outward unit normals (m, 3) at points (m, 3) on a shape."""
    turn = shape.pose[:3, :3].astype(np.float32)
    local = (points - shape.pose[:3, 3].astype(np.float32)) @ turn
    size = np.array(shape.size, dtype=np.float32)
    if shape.kind == "box":
        face = np.abs(local) / size
        outward = np.where(face == greatest(face)[:, None], np.sign(local), np.float32(0))
    else:
        outward = local.copy()
        if shape.kind == "capsule":
            outward[:, 2] -= np.clip(local[:, 2], -size[1], size[1])
        elif shape.kind == "cylinder":
            end = size[1] - np.abs(local[:, 2]) < 1e-3 * size[1]
            outward[:, 2] = 0
            outward[end] = np.sign(local[end]) * np.array([0, 0, 1], dtype=np.float32)
    return np.asarray(outward / np.sqrt(dot(outward, outward))[:, None] @ turn.T, dtype=np.float32)


def dot(one: Rays, other: Rays) -> Rays:
    """Products (m,) of vectors (m, 3): faster than a sum over such a short axis."""
    return np.asarray(np.einsum("ij,ij->i", one, other))


def extent(shape: Shape) -> float:
    """Radius of the sphere around the shape's centre that holds all of it, m."""
    a, b, c = shape.size
    return {
        "sphere": a,
        "capsule": a + b,
        "cylinder": float(np.hypot(a, b)),
        "box": float(np.linalg.norm([a, b, c])),
    }[shape.kind]


def greatest(values: Rays) -> Rays:
    """Greatest component (m,) of each vector (m, 3), ditto."""
    return np.maximum(np.maximum(values[:, 0], values[:, 1]), values[:, 2])
