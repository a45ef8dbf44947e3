"""Where a picture is taken from, and where points of the world are in it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from plancurate.robots.shapes import FloatArray, Shape
from plancurate.tasks.pictures.rays import Rays

FIELD = 0.62  # rad, the angle that the picture's height takes up
DIRECTION = (
    -0.42,
    -0.78,
    0.46,
)  # from the robot's side, a little from behind, so that one looks into shelves
FILLED = np.array([0.94, 0.84])  # of the picture, in its width or its height: words stand at the foot
MIDDLE = np.array([0.5, 0.46])  # of what is filled
ROUNDS = 8  # of moving the camera until that is so


@dataclass(frozen=True)
class Camera:
    """A pinhole camera: `eye` and what it looks `at`, m, z upwards; the picture's size in pixels."""

    eye: tuple[float, float, float]
    at: tuple[float, float, float]
    width: int
    height: int

    @cached_property
    def turn(self) -> FloatArray:
        """Rows (3, 3): right, down and forward in the world."""
        forward = np.array(self.at) - self.eye
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(forward, right), forward])

    @property
    def focal(self) -> float:
        """Pixels that a thing of 1 m takes up at 1 m."""
        return float(self.height / 2 / np.tan(FIELD / 2))

    def project(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Pixels (k, 2), right and down, and distances (k,) from the eye of points (k, 3), m, before the camera."""
        seen = (points - np.array(self.eye)) @ self.turn.T
        pixels = self.focal * seen[:, :2] / seen[:, 2:] + np.array([self.width / 2, self.height / 2])
        return pixels, np.linalg.norm(seen, axis=1)

    def larger(self, by: int) -> Camera:
        """The same view with so many times as many pixels along each side."""
        return Camera(self.eye, self.at, by * self.width, by * self.height)

    @cached_property
    def rays(self) -> Rays:
        """Unit directions (height, width, 3) through the middle of each pixel."""
        x = (np.arange(self.width) + 0.5 - self.width / 2) / self.focal
        y = (np.arange(self.height) + 0.5 - self.height / 2) / self.focal
        right, down, forward = self.turn.astype(np.float32)
        way = (
            x[None, :, None].astype(np.float32) * right + y[:, None, None].astype(np.float32) * down + forward
        )
        return np.asarray(way / np.linalg.norm(way, axis=2, keepdims=True))


def camera_for(
    shapes: Sequence[Shape], size: tuple[int, int], direction: tuple[float, float, float] = DIRECTION
) -> Camera:
    """A camera that has all of the shapes in the middle of a picture of that width and height."""
    centres, radii = (np.concatenate(parts) for parts in zip(*map(balls, shapes), strict=True))
    towards = np.array(direction) / np.linalg.norm(direction)
    low, high = (centres - radii[:, None]).min(axis=0), (centres + radii[:, None]).max(axis=0)
    at, away, half = (low + high) / 2, float(np.linalg.norm(high - low)), np.array(size) / 2
    for _ in range(ROUNDS):
        camera = Camera(triple(at + away * towards), triple(at), *size)
        pixels, distances = camera.project(centres)
        spread = (camera.focal * radii / distances)[:, None]
        least, most = (pixels - spread).min(axis=0), (pixels + spread).max(axis=0)
        aside = (least + most) / 2 - 2 * half * MIDDLE
        at = at + away / camera.focal * (aside @ camera.turn[:2])
        away *= float(((most - least) / 2 / half / FILLED).max())
    return camera


def balls(shape: Shape) -> tuple[FloatArray, FloatArray]:
    """Centres (k, 3) and radii (k,), m, of balls whose hull holds the shape, closely."""
    a, b, c = shape.size
    if shape.kind == "box":
        local, radius = np.array(list(product((-a, a), (-b, b), (-c, c)))), 0.0
    else:
        local, radius = np.array([[0.0, 0.0, -b], [0.0, 0.0, b]]), a
    return local @ shape.pose[:3, :3].T + shape.pose[:3, 3], np.full(len(local), radius)


def triple(values: FloatArray) -> tuple[float, float, float]:
    """Three plain numbers."""
    x, y, z = values.tolist()
    return x, y, z
