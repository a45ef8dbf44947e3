from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.robots import load_robot, load_scene
from plancurate.tasks.candidates.plan import plan_candidate, seed_of
from plancurate.tasks.candidates.settings import GenerateSettings, PlanSettings, TargetSettings
from plancurate.tasks.candidates.targets import sample_targets

ROBOT = load_robot("h2017")
SCENE = load_scene("table")
TARGET = sample_targets(ROBOT, SCENE, TargetSettings(), 1, 1)[0]


def plan(planner, run=0, robot=ROBOT, **settings):
    """Plan to the target's own goals with some settings of planning."""
    settings = GenerateSettings(plan=PlanSettings(goals="all", **settings))
    return plan_candidate(robot, SCENE, TARGET, planner, run, settings)


def test_a_path_leads_from_home_to_the_goal_that_it_names():
    planned = plan("RRTConnect")
    assert planned.status == "exact"
    assert np.array_equal(planned.path[0], ROBOT.home)
    assert np.abs(TARGET.goals - planned.path[-1]).max(axis=1).min() < 1e-9


def test_a_run_repeats_exactly_and_the_next_one_differs():
    first, again, second = (plan("RRT", run, simplification="off") for run in (0, 0, 1))
    assert np.array_equal(first.path, again.path)
    assert first.seed == again.seed != second.seed
    assert not np.array_equal(first.path, second.path)


def test_a_spent_budget_is_an_outcome_not_an_error():
    planned = plan("RRT", state_checks=1)
    assert planned.status != "exact"
    assert planned.reason


def test_parameters_reach_the_planner_and_wrong_ones_are_errors():
    plain = plan("RRT", simplification="off")
    biased = plan("RRT", simplification="off", params={"RRT": {"goal_bias": "0.9"}})
    assert plain.state_checks != biased.state_checks
    with pytest.raises(PlancurateError, match=r"planner RRT: .*range"):
        plan("RRT", params={"RRT": {"range": "far"}})


def test_unknown_parameters_are_found_before_anything_is_planned():
    with pytest.raises(UnknownNameError, match="planner 'RTT'"):
        PlanSettings(params={"RTT": {}})
    with pytest.raises(UnknownNameError, match="parameter of planner RRT 'rang': did you mean range"):
        PlanSettings(params={"RRT": {"rang": "1"}})


def test_seeds_are_the_same_on_every_machine():
    assert seed_of(0, 12, "RRTstar", 1) == 1576511477
    assert seed_of(0, 12, "RRTstar", 2) != seed_of(0, 12, "RRTstar", 1)


@given(st.integers(0, 2**31), st.integers(0, 10**6), st.integers(0, 100))
def test_seeds_fit_31_bits(seed, target_id, run):
    assert 0 <= seed_of(seed, target_id, "PRM", run) < 2**31


def test_a_start_in_collision_is_an_outcome_with_its_reason():
    folded = replace(ROBOT, home=np.array([0.0, 1.5, 2.2, 0, 0, 0]))
    planned = plan("RRT", robot=folded)
    assert planned.status == "none"
    assert "start" in planned.reason
