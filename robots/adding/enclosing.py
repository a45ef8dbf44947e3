"""The smallest primitive around points: a sphere, capsule, cylinder or box that provably holds them all."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from plancurate.robots.adding.surroundings import Surroundings
from plancurate.robots.shapes import FloatArray, Shape

ROUNDING = 1e-5  # m beyond the points, above what single precision and the URDF's digits lose
LONGER_CAPSULES = (
    1.0,
    1.03,
    1.08,
    1.15,
)  # radii tried, times the least: a wider capsule may be a shorter one
CAPSULE_BONUS = 0.9  # capsules are checked fastest, so that one wins against a box of nearly its volume
NEARLY_PARALLEL = 0.995  # cosine
MOST_TURNS = 12  # of a box about its axis that are tried
COMPASS = np.array([np.cos(np.arange(48) * np.pi / 24), np.sin(np.arange(48) * np.pi / 24)])
TILTS, SPREADS = 12, (0.2, 0.08, 0.03)  # directions drawn around the best one, rad


def enclose(
    points: FloatArray,
    room: Surroundings,
    refine: bool = False,
    touches: Callable[[Shape], float] = lambda shape: 0.0,
) -> Shape:
    """Return the primitive that holds the points (n,3) and, of those tried, `touches` least, and then sticks out
    least into `room`."""
    points = hull_points(points)

    def cost(shape: Shape) -> tuple[float, float, float]:
        bonus = CAPSULE_BONUS if shape.kind in ("capsule", "sphere") else 1.0
        return touches(shape), bonus * room.excess(room.reached(shape)), volume(shape)

    best = min((shape for d in directions(points) for shape in _along(points, d)), key=cost)
    if refine:
        rng = np.random.default_rng(0)
        for spread in SPREADS:
            tilted = best.pose[:3, 2] + spread * rng.normal(size=(TILTS, 3))
            best = min([best, *(shape for d in tilted for shape in _along(points, d))], key=cost)
    return best


def volume(shape: Shape) -> float:
    """Volume of a primitive, m3."""
    a, b, c = shape.size
    if shape.kind == "box":
        return 8 * a * b * c
    round_part = 4 / 3 * np.pi * a**3 if shape.kind != "cylinder" else 0.0
    return float(2 * np.pi * a**2 * b + round_part)


def hull_points(points: FloatArray) -> FloatArray:
    """The corners (m,3) of the convex hull of the points (n,3); all of them where they lie in a plane."""
    points = np.unique(points, axis=0)
    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except (QhullError, ValueError):
        return points


def directions(points: FloatArray) -> FloatArray:
    """Unit directions (k,3): the frame's axes, and the points' own where those differ."""
    if len(points) < 3:
        return np.eye(3)
    own = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2]
    return np.concatenate([np.eye(3), own[np.abs(own).max(axis=1) < NEARLY_PARALLEL]])


def _along(points: FloatArray, direction: FloatArray) -> list[Shape]:
    """A capsule (or sphere), a cylinder and a box along `direction`, which need not be a unit vector."""
    axes = _frame(direction / np.linalg.norm(direction))
    local = points @ axes  # columns: two across, one along
    outline = _outline(local[:, :2])
    centre = enclosing_circle(outline)[0]
    radius = float(np.linalg.norm(local[:, :2] - centre, axis=1).max())
    low, high = local[:, 2].min(), local[:, 2].max()
    middle = axes @ np.array([*centre, (low + high) / 2])
    cylinder = Shape("cylinder", (radius, (high - low) / 2, 0.0), _pose(axes, middle))
    box = _box(local, outline, axes)
    return [shape.grown(ROUNDING) for shape in (_capsule(local, centre, radius, axes), cylinder, box)]


def _capsule(local: FloatArray, centre: FloatArray, least: float, axes: FloatArray) -> Shape:
    """The least capsule with its axis through `centre`, whose radius is `least` or a little more."""
    across, along = np.linalg.norm(local[:, :2] - centre, axis=1), local[:, 2]
    shapes = []
    for factor in LONGER_CAPSULES:
        radius = max(least * factor, 1e-6)
        cap = np.sqrt(np.maximum(radius**2 - across**2, 0.0))
        low, high = (along + cap).min(), (along - cap).max()
        half = max((high - low) / 2, 0.0)
        pose = _pose(axes, axes @ np.array([*centre, (low + high) / 2]))
        shapes.append(Shape("capsule" if half > 0 else "sphere", (radius, half, 0.0), pose))
    return min(shapes, key=volume)


def _box(local: FloatArray, outline: FloatArray, axes: FloatArray) -> Shape:
    """The least box along the third axis: across it, its sides lie along an edge of the outline (c,2)."""
    edges = np.roll(outline, -1, axis=0) - outline
    angles = np.unique(np.round(np.arctan2(edges[:, 1], edges[:, 0]) % (np.pi / 2), 4))
    angles = angles[:: -(-len(angles) // MOST_TURNS)]
    sides = np.concatenate(
        [(np.cos(angles), np.sin(angles)), (-np.sin(angles), np.cos(angles))], axis=1
    )  # (2,2a)
    spans = np.ptp(outline @ sides, axis=0).reshape(2, -1)
    least = angles[spans.prod(axis=0).argmin()]
    turn = np.array(
        [[np.cos(least), -np.sin(least), 0.0], [np.sin(least), np.cos(least), 0.0], [0.0, 0.0, 1.0]]
    )
    inside = local @ turn
    low, high = inside.min(axis=0), inside.max(axis=0)
    a, b, c = ((high - low) / 2).tolist()
    return Shape("box", (a, b, c), _pose(axes @ turn, axes @ turn @ ((low + high) / 2)))


def _outline(points: FloatArray) -> FloatArray:
    """The points (c,2) that are farthest in some direction, in order: nearly all corners of the convex hull."""
    farthest = (points @ COMPASS).argmax(axis=0)
    return np.asarray(points[farthest[farthest != np.roll(farthest, 1)]]) if np.ptp(farthest) else points[:1]


def enclosing_circle(points: FloatArray) -> tuple[FloatArray, float]:
    """Centre (2,) and radius of the smallest circle around points (n,2): the farthest point joins its support."""
    ends = points[[points[:, 0].argmin(), points[:, 0].argmax()]]
    support, centre, radius = ends, ends.mean(axis=0), float(np.linalg.norm(ends[1] - ends[0])) / 2
    for _ in range(100):
        distances = np.linalg.norm(points - centre, axis=1)
        farthest = int(distances.argmax())
        if distances[farthest] <= radius * (1 + 1e-9) + 1e-12:
            break
        support, centre, radius = _least_circle(np.concatenate([support, points[farthest : farthest + 1]]))
    return centre, float(np.linalg.norm(points - centre, axis=1).max())


def _least_circle(points: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """The smallest circle around at most four points, with those of them that it passes through."""
    found = []
    newest = len(points) - 1  # it lies outside the last circle, so that the next one passes through it
    for size in (1, 2):
        for others in combinations(range(newest), size):
            corners = points[[*others, newest]]
            centre = corners.mean(axis=0) if size == 1 else _circumcentre(corners)
            if centre is None:
                continue
            radius = float(np.linalg.norm(corners - centre, axis=1).max())
            if (np.linalg.norm(points - centre, axis=1) <= radius * (1 + 1e-9) + 1e-12).all():
                found.append((radius, corners, centre))
    radius, corners, centre = min(found, key=lambda circle: circle[0])
    return corners, centre, radius


def _circumcentre(corners: FloatArray) -> FloatArray | None:
    sides = corners[1:] - corners[0]
    if abs(np.linalg.det(sides)) < 1e-15:
        return None
    return np.asarray(corners[0] + np.linalg.solve(sides, (sides**2).sum(axis=1) / 2))


def _frame(axis: FloatArray) -> FloatArray:
    """A rotation (3,3) whose third column is the unit `axis`."""
    helper = np.eye(3)[np.abs(axis).argmin()]
    first = np.cross(helper, axis)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(axis, first), axis], axis=1)


def _pose(axes: FloatArray, position: FloatArray) -> FloatArray:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = axes, position
    return pose
