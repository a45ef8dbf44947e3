"""Rays through every pixel: an arm in a scene as an image, without a screen and without meshes.

PyBullet's software renderer has no smooth edges and draws the round ends of capsules as cones; it is a little faster.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from plancurate.robots.shapes import Shape
from plancurate.tasks.pictures.camera import Camera
from plancurate.tasks.pictures.light import SHADE, colour, in_shadow, lit
from plancurate.tasks.pictures.rays import NEVER, Rays, distances, extent, normals
from plancurate.tasks.pictures.solids import Solid

FINER = 2  # rays along each side of a pixel
SKY, FLOOR, GRID = colour("#ffffff"), colour("#f1f3f5"), colour("#d5dae0")
GRID_STEP, GRID_WIDTH = 0.5, 0.012  # m
THROUGH = 0.28  # how much of an arm behind an obstacle is seen
Image = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Layer:
    """What the rays of a finer camera meet: colours (h, w, 3), 0 to 1, and distances (h, w), m."""

    colours: Rays
    distances: Rays


@dataclass(frozen=True, eq=False)
class Backdrop:
    """A scene without the arm, made once for many pictures."""

    camera: Camera
    fine: Camera
    layer: Layer
    small: Rays
    """Colours (h, w, 3) at the picture's own size."""
    nearest: Rays
    """Distances (h, w), ditto."""
    obstacle: NDArray[np.bool_]
    """Where (h, w) the finer camera sees an obstacle, not floor or nothing."""
    shapes: tuple[Shape, ...]


def backdrop(camera: Camera, solids: Sequence[Solid], ground: float | None) -> Backdrop:
    """Obstacles on a floor at that height, if there is one."""
    fine = camera.larger(FINER)
    shapes = tuple(solid.shape for solid in solids)
    found = cast(fine, solids, shapes)
    obstacle = found.distances < NEVER
    floor = floor_layer(fine, ground, shapes)
    nearer = found.distances <= floor.distances
    layer = Layer(
        np.where(nearer[..., None] & obstacle[..., None], found.colours, floor.colours),
        np.minimum(found.distances, floor.distances),
    )
    small = pooled(layer.colours)
    return Backdrop(camera, fine, layer, small, layer.distances[::FINER, ::FINER], obstacle & nearer, shapes)


def picture(behind: Backdrop, arm: Sequence[Solid]) -> tuple[Image, Rays]:
    """The arm before its backdrop (h, w, 3), and the distances (h, w), m, of what is seen."""
    shapes = [solid.shape for solid in arm]
    layer = cast(behind.fine, arm, [*shapes, *behind.shapes])
    there = layer.distances < NEVER
    seen = (there & (layer.distances < behind.layer.distances)).astype(np.float32)
    seen += THROUGH * (there & (seen == 0) & behind.obstacle)
    cover = pooled(seen[..., None])
    below = behind.small * shade(behind, shapes)[..., None]
    both = pooled(layer.colours * seen[..., None]) + (1 - cover) * below
    nearest = np.minimum(layer.distances[::FINER, ::FINER], behind.nearest)
    return (255 * np.clip(both, 0, 1)).astype(np.uint8), nearest


def shade(behind: Backdrop, shapes: Sequence[Shape]) -> Rays:
    """How bright (h, w) the backdrop is under the arm: 1, or less in its shadow."""
    camera, far = behind.camera, behind.nearest
    at = np.flatnonzero(np.isfinite(far).ravel())
    points = np.array(camera.eye, dtype=np.float32) + far.ravel()[at, None] * camera.rays.reshape(-1, 3)[at]
    bright = np.ones(far.size, dtype=np.float32)
    bright[at[in_shadow(points, shapes)]] = 0.72
    return softened(bright.reshape(far.shape))


def cast(camera: Camera, solids: Sequence[Solid], blockers: Sequence[Shape]) -> Layer:
    """The nearest solid along each ray, in its colour and light."""
    shape = (camera.height, camera.width)
    best, which = np.full(shape, NEVER), np.full(shape, -1, dtype=np.int16)
    eye = np.array(camera.eye, dtype=np.float32)
    for number, solid in enumerate(solids):
        window = window_of(camera, solid.shape)
        far = distances(solid.shape, eye, camera.rays[window].reshape(-1, 3)).reshape(best[window].shape)
        nearer = far < best[window]
        best[window][nearer] = far[nearer]
        which[window][nearer] = number
    colours = np.zeros((*shape, 3), dtype=np.float32)
    for number, solid in enumerate(solids):
        rows, columns = np.nonzero(which == number)
        points = eye + best[rows, columns, None] * camera.rays[rows, columns]
        light = lit(points, normals(solid.shape, points), blockers)
        colours[rows, columns] = light[:, None] * colour(solid.colour).astype(np.float32)
    return Layer(colours, best)


def window_of(camera: Camera, shape: Shape) -> tuple[slice, slice]:
    """Rows and columns of the picture that hold all of a shape."""
    (centre,), (distance,) = camera.project(shape.pose[None, :3, 3])
    radius = extent(shape)
    if distance <= 1.05 * radius:
        return slice(None), slice(None)
    half = 1.3 * camera.focal * radius / np.sqrt(distance**2 - radius**2) + 2  # perspective stretches balls
    left, top = np.maximum(centre - half, 0).astype(int)
    right, bottom = np.maximum(centre + half, 0).astype(int)
    return slice(top, bottom), slice(left, right)


def floor_layer(camera: Camera, ground: float | None, blockers: Sequence[Shape]) -> Layer:
    """A floor with lines every half metre that fades into the distance."""
    shape = (camera.height, camera.width)
    colours = np.broadcast_to(SKY.astype(np.float32), (*shape, 3)).copy()
    far = np.full(shape, NEVER)
    if ground is None:
        return Layer(colours, far)
    rows, columns = np.nonzero(camera.rays[..., 2] < -1e-3)
    way = camera.rays[rows, columns]
    along = (np.float32(ground) - np.float32(camera.eye[2])) / way[:, 2]
    points = np.array(camera.eye, dtype=np.float32) + along[:, None] * way
    off = np.abs((points[:, :2] + GRID_STEP / 2) % GRID_STEP - GRID_STEP / 2)
    line = np.asarray((off < GRID_WIDTH / 2).any(axis=1))
    surface = np.where(line[:, None], GRID, FLOOR)
    surface = surface * np.where(in_shadow(points, blockers), SHADE + 0.2, 1.0)[:, None]
    away = np.linalg.norm(np.array(camera.at) - camera.eye)
    fade = np.clip((along - 1.3 * away) / (1.5 * away), 0, 1)[:, None]
    colours[rows, columns] = surface * (1 - fade) + SKY * fade
    far[rows, columns] = along
    return Layer(colours, far)


def pooled(fine: Rays) -> Rays:
    """Means over the rays of each pixel."""
    parts = (fine[i::FINER, j::FINER] for i in range(FINER) for j in range(FINER))
    return np.asarray(sum(parts) / FINER**2)


def softened(values: Rays) -> Rays:
    """Means (h, w) over each pixel and its neighbours: a shadow without stairs."""
    padded = np.pad(values, 1, mode="edge")
    rows = padded[:-2] + padded[1:-1] + padded[2:]
    return np.asarray((rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:]) / 9)
