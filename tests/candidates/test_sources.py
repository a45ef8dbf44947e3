import importlib.util
from dataclasses import replace

import numpy as np
import pytest

from plancurate import native
from plancurate.errors import UnknownNameError
from plancurate.robots import load_robot, load_scene
from plancurate.tasks.candidates.generate import generate_candidates
from plancurate.tasks.candidates.settings import GenerateSettings, PlanSettings
from plancurate.tasks.candidates.sources import PlannedPath, base, find_source, source_names
from plancurate.tasks.candidates.targets import sample_targets

ROBOT, SCENE = load_robot("h2017"), load_scene("free")
SETTINGS = GenerateSettings(plan=PlanSettings(runs=2))
TARGETS = sample_targets(ROBOT, SCENE, SETTINGS.targets, 0, 2)

STRAIGHT_LINE = '''
import numpy as np
from plancurate.tasks.candidates.sources import PlannedPath, source

@source("StraightLine", revision=3, params={"bend": "0"})
def straight_line(robot, scene, target, run, seed, settings):
    """Straight to the nearest goal, by way of a point beside it that the run draws."""
    goal = target.goals[np.linalg.norm(target.goals - robot.home, axis=1).argmin()]
    bend = float(settings.plan.params.get("StraightLine", {}).get("bend", "0"))
    middle = (robot.home + goal) / 2 + bend * np.random.default_rng(seed).normal(size=robot.dof)
    return PlannedPath(run, seed, "exact", np.stack([robot.home, middle, goal]))
'''


@pytest.fixture
def straight_line(tmp_path, monkeypatch):
    """A file of a user's that registers a source; the registry is as before afterwards."""
    source_names()
    monkeypatch.setattr(base, "_registry", dict(base._registry))
    file = tmp_path / "straight_line.py"
    file.write_text(STRAIGHT_LINE)
    spec = importlib.util.spec_from_file_location("straight_line", file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)


def test_every_planner_of_ompl_is_a_source_by_its_name():
    assert source_names()[:23] == [planner.name for planner in native.planners()]
    assert find_source("RRT").params == native.planners()[source_names().index("RRT")].params


@pytest.mark.slow
def test_a_file_elsewhere_adds_a_source_whose_paths_become_verified_rows(straight_line):
    bent = SETTINGS.plan.model_copy(update={"params": {"StraightLine": {"bend": "0.05"}}})
    settings = GenerateSettings(plan=PlanSettings.model_validate(bent.model_dump()))
    rows = generate_candidates(ROBOT, SCENE, TARGETS, "StraightLine", settings)[0].to_pylist()
    assert [row["verified"] for row in rows] == [True] * 4
    assert rows[0]["joint_movement"] != rows[1]["joint_movement"]
    for row in rows:
        goal = TARGETS[row["target_id"]].goals[row["goal_index"]]
        np.testing.assert_array_equal(row["goal"], goal)
        np.testing.assert_allclose(row["q"][-1], goal, atol=1e-6)


def test_a_raised_revision_makes_other_rows_and_keeps_the_old_ones_apart(straight_line):
    assert find_source("StraightLine").label == "StraightLine.3"
    assert find_source("RRT").label == "RRT"
    assert replace(find_source("RRT"), revision=2).label == "RRT.2"
    rows = generate_candidates(ROBOT, SCENE, TARGETS, "StraightLine", SETTINGS)[0]
    assert rows["trajectory_id"].to_pylist()[0].startswith("t0000-StraightLine.3-r0-")


def test_parameters_of_a_source_are_checked_like_a_planner_s(straight_line):
    with pytest.raises(UnknownNameError, match="parameter of planner StraightLine 'bent': did you mean bend"):
        PlanSettings(params={"StraightLine": {"bent": "1"}})


def test_two_modules_cannot_share_a_name(straight_line):
    with pytest.raises(
        ValueError, match=r"'RRT' is registered by plancurate\.tasks\.candidates\.sources\.ompl"
    ):
        base.add_source(base.Source("RRT", find_source("StraightLine").plan, 1))


def test_a_path_that_ends_elsewhere_is_no_solution(monkeypatch):
    source_names()
    monkeypatch.setattr(base, "_registry", dict(base._registry))

    @base.source("Still")
    def still(robot, scene, target, run, seed, settings):
        return PlannedPath(run, seed, "exact", np.stack([robot.home, robot.home]))

    row = generate_candidates(ROBOT, SCENE, TARGETS[:1], "Still", SETTINGS)[0].to_pylist()[0]
    assert (row["solved"], row["status"], row["goal_index"], row["goal"]) == (False, "approximate", -1, None)
    home = native.fk(ROBOT.native, ROBOT.home[None])[0, :3, 3]
    assert (
        row["reason"] == f"the path ends {np.linalg.norm(home - TARGETS[0].position):.3f} m from the target"
    )


def test_an_unknown_source_is_an_error_that_names_the_nearest():
    with pytest.raises(UnknownNameError, match="unknown planner 'RRTConect': did you mean RRTConnect"):
        find_source("RRTConect")
