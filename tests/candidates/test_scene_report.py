import numpy as np
import pytest

from plancurate import native
from plancurate.robots import load_world
from plancurate.tasks.candidates.consistent_goals import draw_targets
from plancurate.tasks.candidates.scene_report import is_hard, scene_report
from plancurate.tasks.candidates.settings import GenerateSettings, PlanSettings, TargetSettings
from plancurate.tasks.candidates.targets import sample_targets

SETTINGS = GenerateSettings(
    targets=TargetSettings(orientation="cone", cone_deg=30), plan=PlanSettings(clearance_m=0.02, runs=2)
)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("robot", "scene", "hard"),
    [
        ("h2017", "shelf", 0.5),
        ("h2017", "passage", 0.5),
        ("h2017", "clutter", 1 / 3),
        ("seven", "shelf", 0.5),
    ],
)
def test_scenes_are_hard_for_a_straight_line_only(robot, scene, hard, robot_folders, record_property):
    world = load_world(robot_folders.get(robot, robot), scene)
    report = scene_report(*world, draw_targets(*world, SETTINGS, 0, 20), SETTINGS, "RRTConnect")
    record_property("report", str(report))
    assert report.reached >= 0.95
    assert report.hard >= hard
    assert report.ways > 1.2
    assert report.least_clearance > 0.02


def test_a_target_is_hard_when_a_state_on_the_straight_line_collides():
    robot, scene = load_world("h2017", "table")
    targets = sample_targets(robot, scene, SETTINGS.targets, 0, 12)
    hard = [is_hard(robot, scene, target.goals, SETTINGS) for target in targets]
    for target, expected in zip(targets, hard, strict=True):
        goal = min(target.goals, key=lambda goal: np.linalg.norm(goal - robot.home))
        states = np.linspace(robot.home, goal, 2000)
        assert native.is_free(robot.native, scene.native, states).all() == (not expected)
    assert set(hard) == {True, False}


def test_an_empty_room_asks_for_nothing():
    world, settings = load_world("h2017", "free"), GenerateSettings(plan=PlanSettings(runs=1))
    report = scene_report(*world, draw_targets(*world, settings, 0, 6), settings, "RRTConnect")
    assert (report.reached, report.solved, report.hard, report.ways) == (1, 1, 0, 1)
    assert report.least_clearance > 0.1
