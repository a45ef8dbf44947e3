"""Whether a study in a scene would say anything: what a planner and a straight line reach of its targets and tests."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.tasks.candidates.consistent_goals import draw_targets
from plancurate.tasks.candidates.scene_report import SceneReport, scene_report
from plancurate.tasks.candidates.settings import GenerateSettings
from plancurate.tasks.learning.reach import PLANNER
from plancurate.tasks.learning.test_targets import displaced_tests, reachable_tests

HARD = 1 / 3  # share of hard targets from which on a scene is worth a study
EASY = 0.1  # share of hard targets below which results say little
OUT_OF_REACH = 0.5  # share of targets that a planner must reach


@dataclass(frozen=True)
class SceneCheck:
    """A planner's runs to targets, and a single run to each of the displaced tests around them."""

    planned: SceneReport
    tests_planner: str
    """Planner of the runs to tests."""
    tests: int
    """Displaced test positions, up to 5 cm from a target."""
    tests_reached: float
    """Share of them that a planner reaches."""
    tests_hard: float
    """Share of those reached for which the straight joint line to the nearest goal is not free."""

    @property
    def verdict(self) -> str:
        """Whether the scene is worth a study, in a sentence for a person."""
        reached, hard = self.planned.reached, self.planned.hard
        if reached < OUT_OF_REACH:
            return (
                f"out of reach: {self.planned.planner} reaches {reached:.0%} of the targets; "
                "another start, tolerance, clearance or region is needed"
            )
        if hard >= HARD:
            return f"hard for {hard:.0%} of the targets: worth a study"
        straight = f"a straight line reaches {1 - hard:.0%} of the targets"
        if hard >= EASY:
            return f"partly hard: {straight}; look at success on the hard ones"
        return f"easy: {straight}; results here say little"


def check_scene(
    robot: Robot, scene: Scene, settings: GenerateSettings, n: int, planner: str = "RRTConnect", seed: int = 0
) -> SceneCheck:
    """Plan to `n` targets and to their displaced tests; `seed` draws the tests' directions, as in an evaluation.

    Raises PlancurateError where targets can't be drawn, or for an unknown planner or parameter.
    """
    targets = draw_targets(robot, scene, settings, 0, n)
    planned = scene_report(robot, scene, targets, settings, planner)
    drawn = displaced_tests(targets, seed)
    kept = reachable_tests(drawn, robot, [scene] * len(drawn), settings, seed)
    hard = float(np.mean(kept.hard)) if kept.hard is not None and len(kept) else 0.0
    return SceneCheck(planned, PLANNER, len(drawn), len(kept) / len(drawn), hard)
