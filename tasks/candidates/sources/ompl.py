"""OMPL's planners, each a source by its class name."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.tasks.candidates.sources.base import PlannedPath, Source, add_source

if TYPE_CHECKING:
    from plancurate.robots.robot import Robot
    from plancurate.robots.scene import Scene
    from plancurate.robots.shapes import FloatArray
    from plancurate.tasks.candidates.settings import GenerateSettings, PlanSettings
    from plancurate.tasks.candidates.targets import Target

REVISION = 1  # raise when paths change for the same arguments and the same version of OMPL


@dataclass(frozen=True)
class OmplPlanner:
    """Plans from home to the goals that the settings give a run, with the planner's clearance."""

    name: str

    def __call__(
        self, robot: Robot, scene: Scene, target: Target, run: int, seed: int, settings: GenerateSettings
    ) -> PlannedPath:
        """Plan one run; it depends on the arguments alone unless `seconds` end it."""
        from plancurate.tasks.candidates.goals import planning_scene, run_goals
        from plancurate.tasks.candidates.relaxed import relaxed

        kept = planning_scene(scene, settings.plan)
        goals = run_goals(robot, kept, target, seed, settings)
        if not len(goals):
            reason = "no goal configuration was found within the target's tolerance and the clearance"
            return PlannedPath(run, seed, "none", goals, reason, "goal")
        result = run_planner(self.name, robot, kept, robot.home, goals, settings.plan, seed)
        path, began = result.path, time.perf_counter()
        if result.status == "exact" and settings.plan.simplification == "relaxed":
            path = relaxed(robot, scene, kept, path, settings.plan.resolution)
        return PlannedPath(
            run,
            seed,
            result.status,
            path,
            result.reason,
            result.termination,
            result.state_checks,
            result.motion_checks,
            result.seconds + time.perf_counter() - began,
        )


def run_planner(
    planner: str,
    robot: Robot,
    scene: Scene,
    start: FloatArray,
    goals: FloatArray,
    settings: PlanSettings,
    seed: int,
) -> native.Result:
    """Plan from start (n,) to any of goals (k, n), rad, within the settings' budget, in the scene as it is.

    Paths that are to be relaxed are shortened all the way here. Raises PlancurateError for a parameter that the planner
    refuses.
    """
    budget = native.Budget(state_checks=settings.state_checks, polls=settings.polls, seconds=settings.seconds)
    try:
        return native.plan(
            robot.native,
            scene.native,
            planner,
            start,
            goals,
            params=settings.params.get(planner, {}),
            seed=seed,
            budget=budget,
            resolution=settings.resolution,
            simplification="full" if settings.simplification == "relaxed" else settings.simplification,
        )
    except ValueError as error:
        raise PlancurateError(f"planner {planner}: {error}") from None


for _planner in native.planners():
    add_source(Source(_planner.name, OmplPlanner(_planner.name), REVISION, _planner.params))
