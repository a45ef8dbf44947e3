"""Motions that `plancurate import` brought in: they are in the lake already, and nobody plans them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plancurate.errors import PlancurateError
from plancurate.tasks.candidates.sources.base import PlannedPath, source

if TYPE_CHECKING:
    from plancurate.robots.robot import Robot
    from plancurate.robots.scene import Scene
    from plancurate.tasks.candidates.settings import GenerateSettings
    from plancurate.tasks.candidates.targets import Target


SOURCE = "Recorded"


@source(SOURCE)
def recorded(
    robot: Robot, scene: Scene, target: Target, run: int, seed: int, settings: GenerateSettings
) -> PlannedPath:
    """Raise PlancurateError: whoever asks has candidates that were not imported with the same settings."""
    if not settings.targets.recorded:
        raise PlancurateError(
            f"planner {SOURCE}: candidates.targets.recorded names no set; the study file that plancurate import writes "
            "would be right"
        )
    raise PlancurateError(missing(settings.targets.recorded))


def missing(name: str) -> str:
    """Say that this home's lake lacks a set as these settings make candidates of it."""
    return (
        f"recorded set {name}: this home holds no more of it, made with these settings of candidates; the study file "
        "that plancurate import writes has the right ones"
    )
