"""Lines, dots and words on a picture, hidden where something stands before them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import PIL.Image
from PIL import ImageDraw, ImageFont

from plancurate.robots.shapes import FloatArray
from plancurate.tasks.pictures.camera import Camera
from plancurate.tasks.pictures.rays import Rays
from plancurate.tasks.pictures.render import Image

FINER = 2  # dots along each side of a pixel
NEAR = 0.02  # m that a line may lie behind a surface and still be on it
HIDDEN, CLEAR = 80, 255  # opacity behind something and before everything
INK, PAPER = (33, 37, 41), (255, 255, 255, 215)


@dataclass(frozen=True, eq=False)
class Line:
    """A line through points (k, 3), m; its width in pixels."""

    points: FloatArray
    colour: str
    width: float = 2.0


@dataclass(frozen=True, eq=False)
class Dot:
    """A dot at a point (3,), m; its radius in pixels. A ring marks what is aimed at."""

    at: FloatArray
    colour: str
    radius: float = 5.0
    ring: bool = False


def drawn(
    image: Image, nearest: Rays, camera: Camera, lines: Sequence[Line], dots: Sequence[Dot], words: str = ""
) -> Image:
    """The picture (h, w, 3) with lines, dots and words at its foot; `nearest` (h, w), m, hides what is behind."""
    size = (FINER * camera.width, FINER * camera.height)
    sheet = PIL.Image.new("RGBA", size)
    brush = ImageDraw.Draw(sheet)
    for line in lines:
        draw_line(brush, camera, nearest, line)
    for dot in dots:
        draw_dot(brush, camera, nearest, dot)
    below = PIL.Image.fromarray(image).convert("RGBA")
    sheet = sheet.resize((camera.width, camera.height), PIL.Image.Resampling.BOX)
    both = PIL.Image.alpha_composite(below, sheet)
    return np.asarray((written(both, words) if words else both).convert("RGB"))


def draw_line(brush: ImageDraw.ImageDraw, camera: Camera, nearest: Rays, line: Line) -> None:
    """Piece by piece, paler where it is hidden."""
    pixels, distances = camera.project(line.points)
    clear = visible(nearest, pixels, distances)
    width = max(round(FINER * line.width), 1)
    for (start, end), seen in zip(pairwise(pixels), clear[1:], strict=True):
        ends = (*(FINER * start), *(FINER * end))
        brush.line(ends, fill=(line.colour + f"{CLEAR if seen else HIDDEN:02x}"), width=width)


def draw_dot(brush: ImageDraw.ImageDraw, camera: Camera, nearest: Rays, dot: Dot) -> None:
    """A disc or a ring, paler where it is hidden."""
    pixels, distances = camera.project(dot.at[None])
    (x, y), radius = FINER * pixels[0], FINER * dot.radius
    colour = dot.colour + f"{CLEAR if visible(nearest, pixels, distances)[0] else 2 * HIDDEN:02x}"
    box = (x - radius, y - radius, x + radius, y + radius)
    if dot.ring:
        brush.ellipse(box, outline=colour, width=2 * FINER)
        box = (x - radius / 3, y - radius / 3, x + radius / 3, y + radius / 3)
    brush.ellipse(box, fill=colour)


def visible(
    nearest: Rays, pixels: FloatArray, distances: FloatArray
) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Which points (k,) nothing stands before; those outside the picture count as visible."""
    height, width = nearest.shape
    columns = np.clip(pixels[:, 0].astype(int), 0, width - 1)
    rows = np.clip(pixels[:, 1].astype(int), 0, height - 1)
    return np.asarray(distances <= nearest[rows, columns] + NEAR)


def written(image: PIL.Image.Image, words: str) -> PIL.Image.Image:
    """The picture with words on a band at its foot, smaller where they are too long for it."""
    size = max(image.height // 24, 10)
    font = ImageFont.load_default(size)
    while font.getlength(words) > image.width - size and size > 8:
        size -= 1
        font = ImageFont.load_default(size)
    band = PIL.Image.new("RGBA", image.size)
    brush = ImageDraw.Draw(band)
    top = image.height - 2 * size
    brush.rectangle((0, top, image.width, image.height), fill=PAPER)
    brush.text((size / 2, top + size / 3), words, fill=INK, font=font)
    return PIL.Image.alpha_composite(image, band)
