"""What `plancurate scenes check` says: shares by other means, and the verdict on them."""

from __future__ import annotations

import json

import numpy as np
import pytest

from plancurate import native
from plancurate.flows.cli.app import main
from plancurate.robots import load_world
from plancurate.tasks.candidates.scene_report import SceneReport, TargetReport
from plancurate.tasks.candidates.settings import GenerateSettings, PlanSettings, TargetSettings
from plancurate.tasks.candidates.targets import sample_targets
from plancurate.tasks.learning.reach import reach
from plancurate.tasks.learning.scene_check import SceneCheck, check_scene
from plancurate.tasks.learning.test_targets import displaced_tests

SETTINGS = GenerateSettings(targets=TargetSettings(orientation="yaw_free"), plan=PlanSettings(runs=2))
WORDS = ["scenes", "check", "shelf", "--targets", "3", "--runs", "2", "--orientation", "cone"]


def made_up(reached: int, hard: int) -> SceneCheck:
    """Twenty targets of which that many are reached and hard."""
    each = (
        TargetReport(i, (0.0, 0.0, 0.0), int(i < reached), {"g0.p0": 1}, i < hard, None) for i in range(20)
    )
    return SceneCheck(SceneReport("RRT", 1, tuple(each)), "RRTConnect", 320, 1.0, 0.0)


@pytest.mark.parametrize(
    ("reached", "hard", "verdict"),
    [
        (20, 17, "hard for 85% of the targets: worth a study"),
        (20, 7, "hard for 35% of the targets: worth a study"),
        (20, 6, "partly hard: a straight line reaches 70% of the targets; look at success on the hard ones"),
        (20, 1, "easy: a straight line reaches 95% of the targets; results here say little"),
        (
            9,
            17,
            "out of reach: RRT reaches 45% of the targets; another start, tolerance, clearance or region",
        ),
    ],
)
def test_the_verdict_goes_by_what_is_reached_and_hard(reached: int, hard: int, verdict: str) -> None:
    assert made_up(reached, hard).verdict.startswith(verdict)


@pytest.mark.slow
def test_shares_are_those_of_each_target_and_test() -> None:
    robot, scene = load_world("h2017", "shelf")
    found = check_scene(robot, scene, SETTINGS, 3)
    targets = sample_targets(robot, scene, SETTINGS.targets, 0, 3)
    free = []
    for target in targets:
        nearest = min(target.goals, key=lambda goal: float(np.linalg.norm(goal - robot.home)))
        line = np.linspace(robot.home, nearest, 2000)
        free.append(bool(native.is_free(robot.native, scene.native, line).all()))
    assert [not target.hard for target in found.planned.each] == free
    positions = displaced_tests(targets, 0).position
    reached = [
        reach(robot, scene, position, SETTINGS, (0, number)) for number, position in enumerate(positions)
    ]
    planned = [one for one in reached if one.planned]
    assert found.tests == len(reached) == 48
    assert 0 < len(planned) < 48
    assert found.tests_reached == len(planned) / 48
    assert found.tests_hard == sum(one.hard for one in planned) / len(planned)


@pytest.mark.slow
def test_the_command_prints_a_verdict_or_json(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main([*WORDS, "--format", "json"])
    record = json.loads(capsys.readouterr().out)
    assert ended.value.code == 0
    assert [target["target_id"] for target in record["each"]] == [0, 1, 2]
    assert record["solved"] == sum(target["solved"] for target in record["each"]) / 6
    assert record["ways"] == np.mean([len(target["ways"]) for target in record["each"]])
    assert all(sum(target["ways"].values()) == target["solved"] for target in record["each"])
    with pytest.raises(SystemExit):
        main(WORDS)
    assert capsys.readouterr().out.splitlines()[0] == record["verdict"]


@pytest.mark.parametrize(
    ("words", "hints"),
    [
        (["nowhere"], ["scene", "shelf"]),
        (["shelf", "--planner", "RTT"], ["unknown planner", "RRT"]),
        (["shelf", "--targets", "0"], ["--targets = 0", "1 to 10000"]),
        (["shelf", "--cone-deg", "-1"], ["--cone-deg = -1.0", "greater than 0"]),
        (["shelf", "--clearance-m", "-1"], ["--clearance-m = -1.0", "greater than or equal to 0"]),
        (["shelf", "--orientation", "up"], ["orientation", "exact"]),
    ],
)
def test_what_is_wrong_is_said_in_a_line(
    words: list[str], hints: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["scenes", "check", *words])
    said = capsys.readouterr().err
    assert ended.value.code == 2
    assert len(said.splitlines()) == 1
    for hint in hints:
        assert hint in said
