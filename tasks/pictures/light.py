"""Light on surfaces: a far lamp, what is in its shadow, and colours as they are seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from plancurate.robots.shapes import FloatArray, Shape
from plancurate.tasks.pictures.rays import NEVER, Rays, distances, extent

LAMP = np.array([-0.35, -0.5, 0.9], dtype=np.float32)
LAMP /= np.linalg.norm(LAMP)
_SIDE = np.cross(LAMP, [0, 0, 1]) / np.hypot(LAMP[0], LAMP[1])
ACROSS = np.array(
    [_SIDE, np.cross(LAMP, _SIDE), LAMP], dtype=np.float32
)  # rows: two ways across the light, and to it
AMBIENT, SHADE = 0.5, 0.55  # share of light that comes from everywhere; how bright a shadow is on the floor
LIFT = 2e-3  # m above a surface that its shadow rays begin


def lit(points: Rays, outward: Rays, blockers: Sequence[Shape]) -> Rays:
    """Brightness (m,) of surface points (m, 3) with normals (m, 3), 0 to 1."""
    facing = np.maximum(outward @ LAMP, 0)
    bright = facing > 0
    seen = np.ones(len(points), dtype=np.float32)
    seen[bright] = ~in_shadow(points[bright] + LIFT * outward[bright], blockers)
    return np.asarray(AMBIENT + (1 - AMBIENT) * facing * seen + 0.08 * outward[:, 2], dtype=np.float32)


def in_shadow(points: Rays, blockers: Sequence[Shape]) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Which points (m, 3) the lamp does not see for one of the shapes."""
    dark = np.zeros(len(points), dtype=bool)
    across, up, along = ACROSS @ points.T
    for shape in blockers:
        radius = extent(shape)
        u, v, w = ACROSS @ shape.pose[:3, 3].astype(np.float32)
        near = ((across - u) ** 2 + (up - v) ** 2 < radius**2) & (along - w < radius) & ~dark
        candidates = np.flatnonzero(near)
        if len(candidates):
            dark[candidates] = distances(shape, points[candidates], LAMP) < NEVER
    return dark


def colour(hexadecimal: str) -> FloatArray:
    """Red, green and blue (3,), 0 to 1, of a colour such as #d62728."""
    return np.array([int(hexadecimal[i : i + 2], 16) / 255 for i in (1, 3, 5)])
