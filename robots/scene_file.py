"""The content of a scene's YAML file."""

from __future__ import annotations

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from plancurate.bounds import Finite, Positive
from plancurate.robots.scene import Region
from plancurate.robots.shapes import FloatArray, Shape, transform

Triple = tuple[Finite, Finite, Finite]


class Frame:
    """What a file's lengths mean: multiples of `unit` (m), positions from `origin` (3,), m."""

    def __init__(self, unit: float, origin: FloatArray) -> None:
        self.unit, self.origin = unit, origin

    def point(self, xyz: Triple) -> FloatArray:
        """A position (3,) in the frame of the robot's base, m."""
        return self.origin + self.unit * np.array(xyz)


METRES = Frame(1.0, np.zeros(3))


class Entry(BaseModel):
    """An obstacle's name and pose in the frame of the robot's base: lengths, roll-pitch-yaw in rad."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: Annotated[str, Field(min_length=1)]
    xyz: Triple
    rpy: Triple = (0.0, 0.0, 0.0)

    def pose(self, frame: Frame) -> FloatArray:
        """Pose (4,4) of the shape, m."""
        return transform(frame.point(self.xyz).tolist(), self.rpy)


class Box(Entry):
    """A box with its full edge lengths."""

    kind: Literal["box"]
    size: tuple[Positive, Positive, Positive]

    def to_shape(self, frame: Frame) -> Shape:
        """Return the primitive with half extents."""
        x, y, z = (frame.unit * edge for edge in self.size)
        return Shape("box", (x / 2, y / 2, z / 2), self.pose(frame))


class Sphere(Entry):
    """A ball."""

    kind: Literal["sphere"]
    radius: Positive

    def to_shape(self, frame: Frame) -> Shape:
        """Return the primitive."""
        return Shape("sphere", (frame.unit * self.radius, 0.0, 0.0), self.pose(frame))


class Round(Entry):
    """A capsule or a cylinder along its own z; a capsule's length leaves its caps out, as in a URDF."""

    kind: Literal["capsule", "cylinder"]
    radius: Positive
    length: Positive

    def to_shape(self, frame: Frame) -> Shape:
        """Return the primitive with half its length."""
        size = (frame.unit * self.radius, frame.unit * self.length / 2, 0.0)
        return Shape(self.kind, size, self.pose(frame))


class SizedFor(BaseModel):
    """The arm that a file's metres are meant for: its reach, and its shoulder's height above the base, m."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    reach: Positive
    shoulder: Finite

    def frame(self, reach: float, shoulder: FloatArray) -> Frame:
        """What the lengths mean for another arm: as far from its shoulder, by its reach."""
        unit = reach / self.reach
        return Frame(unit, shoulder - unit * np.array([0.0, 0.0, self.shoulder]))


class RegionEntry(BaseModel):
    """A box by its corners, in which targets are drawn."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    min: Triple
    max: Triple

    @model_validator(mode="after")
    def _rises(self) -> Self:
        if not all(low < high for low, high in zip(self.min, self.max, strict=True)):
            raise ValueError("each coordinate of min must be below that of max")
        return self

    def to_region(self, name: str, frame: Frame) -> Region:
        """Return the box in metres."""
        return Region(name, frame.point(self.min), frame.point(self.max))


class SceneFile(BaseModel):
    """A scene: `ground` is the floor's height in m or null, `margin` the clearance in m that plans keep.

    With `scale: reach` all other lengths are multiples of the robot's reach, and positions are seen from its
    shoulder, so that the scene suits any arm. With `sized_for` they are metres for the arm that it describes, and are
    scaled to any other's reach and shoulder. `start` names joint positions (of the robots that it lists, or of any),
    `start_tool` a tool position to start at instead; `tool_axis` is where the tool's z axis points at targets.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    ground: Finite | None
    margin: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.005
    scale: Literal["metres", "reach"] = "metres"
    sized_for: SizedFor | None = None
    start: dict[str, tuple[Finite, ...]] | tuple[Finite, ...] | None = None
    start_tool: Triple | None = None
    tool_axis: Triple | None = None
    regions: dict[str, RegionEntry] = {}
    shapes: tuple[Annotated[Box | Sphere | Round, Field(discriminator="kind")], ...] = ()

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        names = [shape.name for shape in self.shapes]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"shape name '{name}' is given twice; every shape needs its own")
        return self

    @model_validator(mode="after")
    def _one_scale(self) -> Self:
        if self.scale == "reach" and self.sized_for is not None:
            raise ValueError(
                "sized_for says what metres are meant for; scale: reach has none, leave one of them out"
            )
        return self

    @model_validator(mode="after")
    def _axis_points(self) -> Self:
        if self.tool_axis is not None and not any(self.tool_axis):
            raise ValueError("tool_axis 0 0 0 has no direction")
        return self

    @property
    def needs_robot(self) -> bool:
        """Whether the scene depends on the robot that it is loaded for."""
        return self.scale == "reach" or self.start is not None or self.start_tool is not None
