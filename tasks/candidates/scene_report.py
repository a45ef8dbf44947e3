"""What a scene asks of a robot: which targets a planner reaches, how near to obstacles, and which are hard."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from plancurate import native
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.goals import planning_scene
from plancurate.tasks.candidates.metrics import min_clearance
from plancurate.tasks.candidates.path_classes import label_paths
from plancurate.tasks.candidates.plan import plan_candidate
from plancurate.tasks.candidates.settings import GenerateSettings
from plancurate.tasks.candidates.targets import Target, sample_targets


@dataclass(frozen=True)
class SceneReport:
    """Over `targets` targets of a scene, `runs` runs of one planner each; clearances in m, None without obstacles."""

    planner: str
    targets: int
    runs: int
    reached: float
    """Share of targets that some run reaches."""
    solved: float
    """Share of runs that reach their target."""
    hard: float
    """Share of targets for which the straight joint line to the nearest goal is not free."""
    ways: float
    """Mean number of ways in which a reached target is reached."""
    least_clearance: float | None
    """Of all paths."""
    median_clearance: float | None
    """Of the paths' smallest ones."""


def scene_report(
    robot: Robot, scene: Scene, settings: GenerateSettings, n: int, planner: str = "RRTConnect"
) -> SceneReport:
    """Plan to the first `n` targets of these settings; raises PlancurateError where targets can't be drawn."""
    kept = planning_scene(scene, settings.plan)
    targets = sample_targets(robot, kept, settings.targets, 0, n)
    paths, owners = planned_paths(robot, scene, targets, planner, settings)
    labels = set(zip(owners, label_paths(robot, scene, paths, owners), strict=True))
    clearances = [near for path in paths if (near := min_clearance(robot, scene, path)) is not None]
    return SceneReport(
        planner=planner,
        targets=n,
        runs=settings.plan.runs,
        reached=len(set(owners)) / n,
        solved=len(paths) / (n * settings.plan.runs),
        hard=float(np.mean([is_hard(robot, scene, target, settings) for target in targets])),
        ways=len(labels) / max(1, len(set(owners))),
        least_clearance=min(clearances, default=None),
        median_clearance=float(np.median(clearances)) if clearances else None,
    )


def planned_paths(
    robot: Robot, scene: Scene, targets: list[Target], planner: str, settings: GenerateSettings
) -> tuple[list[FloatArray], list[int]]:
    """The paths (w, n) that all runs to all targets found, and the target of each."""
    paths, owners = [], []
    for target in targets:
        for run in range(settings.plan.runs):
            planned = plan_candidate(robot, scene, target, planner, run, settings)
            if planned.status == "exact":
                paths.append(planned.path)
                owners.append(target.target_id)
    return paths, owners


def is_hard(robot: Robot, scene: Scene, target: Target, settings: GenerateSettings) -> bool:
    """Whether the straight joint line from the start to the target's nearest goal is not free."""
    nearest = target.goals[np.linalg.norm(target.goals - robot.home, axis=1).argmin()]
    edge = robot.home[None], nearest[None], settings.plan.resolution
    return not native.edge_is_free(robot.native, scene.native, *edge)[0]
