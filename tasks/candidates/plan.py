"""Plan one candidate: a path to a target by a named source, with the seed of its run."""

from __future__ import annotations

import hashlib

from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.tasks.candidates.settings import GenerateSettings
from plancurate.tasks.candidates.sources import PlannedPath, find_source
from plancurate.tasks.candidates.targets import Target


def plan_candidate(
    robot: Robot, scene: Scene, target: Target, planner: str, run: int, settings: GenerateSettings
) -> PlannedPath:
    """Plan from the robot's home to `target`; raises PlancurateError for an unknown planner or parameter."""
    seed = seed_of(settings.plan.seed, target.target_id, planner, run)
    return find_source(planner).plan(robot, scene, target, run, seed, settings)


def seed_of(seed: int, target_id: int, planner: str, run: int) -> int:
    """Return the 31-bit seed of one run, the same on every machine."""
    digest = hashlib.sha256(f"{seed}/{target_id}/{planner}/{run}".encode()).digest()
    return int.from_bytes(digest[:4], "big") >> 1
