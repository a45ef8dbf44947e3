"""What a scene asks of a robot: which targets a planner reaches, how near to obstacles, and which are hard."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from plancurate import native
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.goals import nearest_goal
from plancurate.tasks.candidates.metrics import min_clearance
from plancurate.tasks.candidates.path_classes import label_paths
from plancurate.tasks.candidates.plan import plan_candidate
from plancurate.tasks.candidates.settings import GenerateSettings
from plancurate.tasks.candidates.targets import Target


@dataclass(frozen=True)
class TargetReport:
    """What became of a planner's runs to one target."""

    target_id: int
    position: tuple[float, ...]
    """m."""
    solved: int
    """Runs that reach it."""
    ways: Mapping[str, int]
    """Runs by the way of their path, as in g0.p1."""
    hard: bool
    """Whether the straight joint line to the nearest goal is not free."""
    clearance: float | None
    """Least of the paths, m; None without a path or without obstacles."""


@dataclass(frozen=True)
class SceneReport:
    """Targets of a scene, and `runs` runs of one planner to each."""

    planner: str
    runs: int
    each: tuple[TargetReport, ...]

    @property
    def targets(self) -> int:
        """Number of targets."""
        return len(self.each)

    @property
    def reached(self) -> float:
        """Share of targets that some run reaches."""
        return float(np.mean([target.solved > 0 for target in self.each]))

    @property
    def solved(self) -> float:
        """Share of runs that reach their target."""
        return float(np.mean([target.solved / self.runs for target in self.each]))

    @property
    def hard(self) -> float:
        """Share of targets for which the straight joint line to the nearest goal is not free."""
        return float(np.mean([target.hard for target in self.each]))

    @property
    def ways(self) -> float:
        """Mean number of ways in which a reached target is reached; 0 when none is."""
        return mean([len(target.ways) for target in self.each if target.solved])

    @property
    def goal_classes(self) -> float:
        """Mean number of classes of goal configurations at which a reached target is reached; 0 when none is."""
        return mean(
            [len({way.split(".")[0] for way in target.ways}) for target in self.each if target.solved]
        )

    @property
    def clearances(self) -> list[float]:
        """Least clearance of the paths to each target, m, of those that have one."""
        return [target.clearance for target in self.each if target.clearance is not None]

    @property
    def least_clearance(self) -> float | None:
        """Least clearance of all paths, m; None without obstacles."""
        return min(self.clearances, default=None)

    @property
    def median_clearance(self) -> float | None:
        """Median over targets of the least clearance of their paths, m; None without obstacles."""
        return float(np.median(self.clearances)) if self.clearances else None


def scene_report(
    robot: Robot, scene: Scene, targets: Sequence[Target], settings: GenerateSettings, planner: str
) -> SceneReport:
    """Plan to targets; raises PlancurateError for an unknown planner or parameter."""
    each = tuple(target_report(robot, scene, target, planner, settings) for target in targets)
    return SceneReport(planner, settings.plan.runs, each)


def target_report(
    robot: Robot, scene: Scene, target: Target, planner: str, settings: GenerateSettings
) -> TargetReport:
    """Do all runs to one target."""
    planned = [
        plan_candidate(robot, scene, target, planner, run, settings) for run in range(settings.plan.runs)
    ]
    paths = [one.path for one in planned if one.status == "exact"]
    near = [distance for path in paths if (distance := min_clearance(robot, scene, path)) is not None]
    return TargetReport(
        target_id=target.target_id,
        position=tuple(target.position.tolist()),
        solved=len(paths),
        ways=dict(Counter(label_paths(robot, scene, paths, [target.target_id] * len(paths)))),
        hard=is_hard(robot, scene, target.goals, settings),
        clearance=min(near, default=None),
    )


def is_hard(robot: Robot, scene: Scene, goals: FloatArray, settings: GenerateSettings) -> bool:
    """Whether the straight joint line from the start to the nearest of the goals (k, n), k >= 1, is not free."""
    edge = robot.home[None], nearest_goal(robot, goals)[None], settings.plan.resolution
    return not native.edge_is_free(robot.native, scene.native, *edge)[0]


def mean(values: list[int]) -> float:
    """Mean of counts; 0 of none."""
    return float(np.mean(values)) if values else 0.0
