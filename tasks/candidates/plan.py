"""Plan one candidate: a path from home to any of a target's goals, by one planner with one seed."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator

from plancurate import native
from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.tasks.candidates.targets import Target


class PlanSettings(BaseModel):
    """How much each planner may work; counts end a run, so that a busy machine plans the same paths."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    runs: int = Field(default=3, gt=0, description="runs of each planner for each target")
    seed: int = Field(default=0, ge=0, description="another seed gives other paths")
    state_checks: int = Field(
        default=100_000, gt=0, description="collision checks of states after which a run ends"
    )
    polls: int = Field(
        default=20_000, gt=0, description="questions whether to go on, ditto: some never check"
    )
    seconds: float = Field(
        default=30, gt=0, description="safety net, s; runs that it ends depend on the machine"
    )
    resolution: float = Field(
        default=0.01, gt=0, description="joint step of collision checks along edges, rad"
    )
    simplification: Literal["off", "partial", "full"] = Field(
        default="full",
        description="how far solutions are shortened: not at all, by a drawn number of shortcuts, all the way",
    )
    params: dict[str, dict[str, str]] = Field(
        default={}, description="a planner's parameters by OMPL's names"
    )

    @field_validator("params")
    @classmethod
    def _known(cls, params: dict[str, dict[str, str]]) -> dict[str, dict[str, str]]:
        infos = {info.name: info for info in native.planners()}
        for planner, names in params.items():
            if planner not in infos:
                raise UnknownNameError("planner", planner, infos)
            for name in names:
                if name not in infos[planner].params:
                    raise UnknownNameError(f"parameter of planner {planner}", name, infos[planner].params)
        return params


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
            simplification=settings.simplification,
        )
    except ValueError as error:
        raise PlancurateError(f"planner {planner}: {error}") from None
    return PlannedPath(run, seed, result)


def seed_of(seed: int, target_id: int, planner: str, run: int) -> int:
    """Return the 31-bit seed of one run, the same on every machine."""
    digest = hashlib.sha256(f"{seed}/{target_id}/{planner}/{run}".encode()).digest()
    return int.from_bytes(digest[:4], "big") >> 1
