"""Plan one candidate: a path from home to any of a target's goals, by one planner with one seed."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.tasks.candidates.settings import PlanSettings
from plancurate.tasks.candidates.targets import Target


@dataclass(frozen=True, eq=False)
class PlannedPath:
    """A run and what became of it."""

    run: int
    seed: int
    result: native.Result


def plan_candidate(
    robot: Robot, scene: Scene, target: Target, planner: str, run: int, settings: PlanSettings
) -> PlannedPath:
    """Plan from home to `target`; the outcome depends on the arguments alone unless `seconds` end the run.

    Raises PlancurateError for a planner or parameter that is not known.
    """
    seed = seed_of(settings.seed, target.target_id, planner, run)
    budget = native.Budget(state_checks=settings.state_checks, polls=settings.polls, seconds=settings.seconds)
    try:
        result = native.plan(
            robot.native,
            scene.native,
            planner,
            robot.home,
            target.goals,
            params=settings.params.get(planner, {}),
            seed=seed,
            budget=budget,
            resolution=settings.resolution,
            simplify=settings.simplify,
        )
    except ValueError as error:
        raise PlancurateError(f"planner {planner}: {error}") from None
    return PlannedPath(run, seed, result)


def seed_of(seed: int, target_id: int, planner: str, run: int) -> int:
    """Return the 31-bit seed of one run, the same on every machine."""
    digest = hashlib.sha256(f"{seed}/{target_id}/{planner}/{run}".encode()).digest()
    return int.from_bytes(digest[:4], "big") >> 1
