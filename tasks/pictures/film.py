"""Shots as images: one that says most, or many one after another."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from plancurate.robots.shapes import FloatArray, Shape
from plancurate.tasks.pictures.camera import DIRECTION, Camera, camera_for
from plancurate.tasks.pictures.drawing import drawn
from plancurate.tasks.pictures.render import Backdrop, Image, backdrop, picture
from plancurate.tasks.pictures.shot import Run, Shot, run_marks, thinned
from plancurate.tasks.pictures.solids import arm_solids, scene_solids

FRAMES_A_SECOND = 12
MOST_FRAMES = 60  # a longer motion is shown faster
HOLD_S = 1.0  # that the end is shown
TURN_FRAMES = 24  # of a film of something that rests: the camera goes around it
FRAMED = 12  # states of the arm that the camera has in view


@dataclass(frozen=True, eq=False)
class Stage:
    """A shot with its camera: everything but the arm is drawn once."""

    shot: Shot
    size: tuple[int, int]
    direction: tuple[float, float, float] = DIRECTION
    beside: Sequence[Shot] = ()
    """Shots beside it, which are to be seen from the same place."""

    @cached_property
    def camera(self) -> Camera:
        """All that moves is in its view."""
        shapes = [shape for shot in (self.shot, *self.beside) for shape in in_view(shot)]
        return camera_for(shapes, self.size, self.direction)

    @cached_property
    def behind(self) -> dict[frozenset[str], Backdrop]:
        """Scene and floor, by which obstacles are touched."""
        return {}

    def backdrop(self, touching: frozenset[str]) -> Backdrop:
        """Scene and floor with what is touched in red."""
        scene = self.shot.scene
        touched = touching.intersection(entry.name for entry in scene.shapes)
        if touched not in self.behind:
            self.behind[touched] = backdrop(self.camera, scene_solids(scene, touched), scene.ground)
        return self.behind[touched]

    def at_rest(self) -> Image:
        """The arm at home, with the shot's lines and dots."""
        shot = self.shot
        return self.image(shot.robot.home, (), shot.title)

    def image(self, q: FloatArray, moving: Sequence[tuple[Run, float]], words: str) -> Image:
        """The arm at q (n,), rad, with the paths of runs up to a time; what touches at a run's end is red."""
        shot, lines, dots = self.shot, [*self.shot.lines], [*self.shot.dots]
        touching: frozenset[str] = frozenset()
        for run, time in moving:
            path, target = run_marks(shot.robot, run, time)
            lines, dots = lines + path, dots + target
            if time >= run.times[-1]:
                touching = run.touching
        image, nearest = picture(self.backdrop(touching), arm_solids(shot.robot, q, touching))
        return drawn(image, nearest, self.camera, lines, dots, words)

    def moment(self, time: float) -> Image:
        """What is to be seen at a time of the film, s, after which the end rests."""
        runs = self.shot.runs
        starts = np.concatenate([[0.0], np.cumsum([run.times[-1] for run in runs])])
        number = min(int(np.searchsorted(starts, time, side="right")) - 1, len(runs) - 1)
        run, at = runs[number], min(time - starts[number], runs[number].times[-1])
        before = [(earlier, float(earlier.times[-1])) for earlier in runs[:number]]
        ended = at >= run.times[-1] and run.said
        words = "; ".join(filter(None, (self.shot.title, run.said if ended else "")))
        return self.image(run.state(at), [*before, (run, at)], words)


def in_view(shot: Shot) -> list[Shape]:
    """Shapes that a picture of the shot must hold."""
    arms = [solid.shape for q in thinned(shot.states, FRAMED) for solid in arm_solids(shot.robot, q)]
    points = [line.points for line in shot.lines] + [dot.at[None] for dot in shot.dots]
    marks = [point_at(point) for cloud in points for point in (cloud.min(axis=0), cloud.max(axis=0))]
    return [*arms, *marks, *(entry.shape for entry in shot.scene.shapes)]


def point_at(position: FloatArray) -> Shape:
    """A point (3,), m, as a shape."""
    pose = np.eye(4)
    pose[:3, 3] = position
    return Shape("sphere", (0.0, 0.0, 0.0), pose)


def length(shot: Shot) -> float:
    """How long a film of the shot's runs is, s."""
    return float(sum(run.times[-1] for run in shot.runs))


def still(shot: Shot, size: tuple[int, int], beside: Sequence[Shot] = ()) -> Image:
    """The end of what the shot shows as one image (h, w, 3)."""
    stage = Stage(shot, size, beside=beside)
    return stage.moment(length(shot)) if shot.runs else stage.at_rest()


def film(shots: Sequence[Shot], size: tuple[int, int]) -> Iterator[Image]:
    """Images (h, w, 3) of shots side by side, FRAMES_A_SECOND; of shots without runs the camera's way around them."""
    total = max(map(length, shots))
    if total == 0:
        for angle in 2 * np.pi * np.arange(TURN_FRAMES) / TURN_FRAMES:
            yield side_by_side([Stage(shot, size, turned(angle), shots).at_rest() for shot in shots])
        return
    stages = [Stage(shot, size, beside=shots) for shot in shots]
    moving = min(round(total * FRAMES_A_SECOND) + 1, MOST_FRAMES)
    for time in np.linspace(0, total, moving):
        last = side_by_side([stage.moment(time) for stage in stages])
        yield last
    for _ in range(round(HOLD_S * FRAMES_A_SECOND)):
        yield last


def side_by_side(images: Sequence[Image]) -> Image:
    """Images of one height beside each other."""
    return np.concatenate(images, axis=1)


def turned(angle: float) -> tuple[float, float, float]:
    """The camera's direction, turned about the vertical by an angle, rad."""
    x, y, z = DIRECTION
    cos, sin = float(np.cos(angle)), float(np.sin(angle))
    return cos * x - sin * y, sin * x + cos * y, z
