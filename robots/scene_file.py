"""The content of a scene's YAML file."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from plancurate.robots.robot_file import Finite, Positive
from plancurate.robots.shapes import Shape, transform

Triple = tuple[Finite, Finite, Finite]


class Entry(BaseModel):
    """An obstacle's name and pose in the frame of the robot's base: metres, roll-pitch-yaw in rad."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: Annotated[str, Field(min_length=1)]
    xyz: Triple
    rpy: Triple = (0.0, 0.0, 0.0)


class Box(Entry):
    """A box with its full edge lengths."""

    kind: Literal["box"]
    size: tuple[Positive, Positive, Positive]

    def to_shape(self) -> Shape:
        """Return the primitive with half extents."""
        x, y, z = self.size
        return Shape("box", (x / 2, y / 2, z / 2), transform(self.xyz, self.rpy))


class Sphere(Entry):
    """A ball."""

    kind: Literal["sphere"]
    radius: Positive

    def to_shape(self) -> Shape:
        """Return the primitive."""
        return Shape("sphere", (self.radius, 0.0, 0.0), transform(self.xyz, self.rpy))


class Round(Entry):
    """A capsule or a cylinder along its own z; a capsule's length leaves its caps out, as in a URDF."""

    kind: Literal["capsule", "cylinder"]
    radius: Positive
    length: Positive

    def to_shape(self) -> Shape:
        """Return the primitive with half its length."""
        return Shape(self.kind, (self.radius, self.length / 2, 0.0), transform(self.xyz, self.rpy))


class SceneFile(BaseModel):
    """A scene: `ground` is the floor's height in m or null, `margin` the clearance in m that plans keep."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    ground: Finite | None
    margin: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.005
    shapes: tuple[Annotated[Box | Sphere | Round, Field(discriminator="kind")], ...] = ()

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        names = [shape.name for shape in self.shapes]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"shape name '{name}' is given twice; every shape needs its own")
        return self
