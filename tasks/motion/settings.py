"""What a motion must keep to beyond its robot's and scene's own limits. Light: configurations import it."""

from __future__ import annotations

from pydantic import Field

from plancurate.bounds import Settings
from plancurate.tasks.candidates.settings import VerifySettings


class MotionSettings(Settings):
    """Tolerances, and how the motion is looked at between its samples and played back."""

    velocity_tolerance: float = Field(
        0.02, ge=0, description="share by which a velocity may exceed its limit between samples"
    )
    acceleration_tolerance: float = Field(
        0.2,
        ge=0,
        description="the same for accelerations and jerks: cubics through samples of a motion that keeps its limits "
        "exceed them where it switches between them",
    )
    torque_tolerance: float = Field(0.0, ge=0, description="the same for torques")
    kept_margin: float = Field(
        0.5,
        ge=0,
        le=1,
        description="share of the scene's margin that must be left: planners keep all of it on straight edges between "
        "samples, which the motion leaves a little",
    )
    resolution: float = Field(
        0.01, ge=1e-4, description="largest joint step between states that are checked, rad (m)"
    )
    min_clearance_m: float = Field(
        0.0, ge=0, description="distance that must be left to obstacles and floor, m"
    )
    playback: VerifySettings = Field(default_factory=VerifySettings, description="Playback in PyBullet.")
