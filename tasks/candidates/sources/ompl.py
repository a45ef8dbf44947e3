"""OMPL's planners, each a source by its class name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.tasks.candidates.sources.base import PlannedPath, Source, add_source

if TYPE_CHECKING:
    from plancurate.robots.robot import Robot
    from plancurate.robots.scene import Scene
    from plancurate.tasks.candidates.settings import GenerateSettings
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

        plan = settings.plan
        kept = planning_scene(scene, plan)
        goals = run_goals(robot, kept, target, seed, settings)
        if not len(goals):
            reason = "no goal configuration was found within the target's tolerance and the clearance"
            return PlannedPath(run, seed, "none", goals, reason, "goal")
        try:
            result = native.plan(
                robot.native,
                kept.native,
                self.name,
                robot.home,
                goals,
                params=plan.params.get(self.name, {}),
                seed=seed,
                budget=native.Budget(state_checks=plan.state_checks, polls=plan.polls, seconds=plan.seconds),
                resolution=plan.resolution,
                simplification=plan.simplification,
            )
        except ValueError as error:
            raise PlancurateError(f"planner {self.name}: {error}") from None
        return PlannedPath(
            run,
            seed,
            result.status,
            result.path,
            result.reason,
            result.termination,
            result.state_checks,
            result.motion_checks,
            result.seconds,
        )


for _planner in native.planners():
    add_source(Source(_planner.name, OmplPlanner(_planner.name), REVISION, _planner.params))
