"""What a scene is: a floor, primitive obstacles, and where targets lie among them."""

from __future__ import annotations

from dataclasses import dataclass, replace

from plancurate import native
from plancurate.robots.shapes import FloatArray, Shape, shape_arrays


@dataclass(frozen=True, eq=False)
class SceneShape:
    """A named obstacle, posed in the frame of the robot's base."""

    name: str
    shape: Shape


@dataclass(frozen=True, eq=False)
class Region:
    """A box in the frame of the robot's base that targets are drawn in: its corners (3,), m."""

    name: str
    lower: FloatArray
    upper: FloatArray


@dataclass(frozen=True, eq=False)
class Scene:
    """Obstacles and the height of the floor (None without one), metres, in the frame of the robot's base."""

    name: str
    shapes: tuple[SceneShape, ...]
    ground: float | None
    margin: float  # clearance in m that a free state has
    native: native.Scene
    digest: str  # of all that the scene's file says, in metres
    regions: tuple[Region, ...] = ()
    tool_axis: FloatArray | None = (
        None  # (3,), where the tool's z axis points at targets; None: as at the start
    )
    start: FloatArray | None = None  # (n,) joint positions that the scene names for the robot; None: its home

    def grown(self, clearance: float) -> Scene:
        """The scene with every obstacle and the floor larger by `clearance` (m) on all sides.

        What is free in it keeps that much more from the obstacles, not from itself: an arm's links are often near
        each other whatever it does. Edges and corners grow by more.
        """
        if clearance == 0:
            return self
        shapes = tuple(SceneShape(entry.name, entry.shape.grown(clearance)) for entry in self.shapes)
        ground = None if self.ground is None else self.ground + clearance
        return replace(self, shapes=shapes, ground=ground, native=native_scene(shapes, ground, self.margin))


def native_scene(shapes: tuple[SceneShape, ...], ground: float | None, margin: float) -> native.Scene:
    """Build the kernel's scene."""
    return native.Scene(ground=ground, margin=margin, **shape_arrays([entry.shape for entry in shapes]))


def empty_scene(margin: float = 0.0) -> Scene:
    """No floor and no shapes: only the robot itself is in its way."""
    return Scene("empty", (), None, margin, native_scene((), None, margin), "")
