"""The content of a robot's `robot.yaml`: what the URDF does not say."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict

from plancurate import bounds

Finite = bounds.Finite
Positive = bounds.Positive


class JointEntry(BaseModel):
    """One moving joint: what plans keep to, rad (m) and s; position and velocity default to the URDF's.

    A limit of the jerk is for the motion verifier alone.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    position: tuple[Finite, Finite] | None = None
    velocity: Positive | None = None
    acceleration: Positive
    jerk: Positive | None = None
    home: Finite


class RobotFile(BaseModel):
    """The content of `robot.yaml`; `urdf` is relative to it, `joints` has one entry a moving joint."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    urdf: str
    tool_link: str
    joints: dict[str, JointEntry]
    allowed_contacts: tuple[tuple[str, str], ...] = ()
    scene_unchecked_links: tuple[str, ...] = ()
