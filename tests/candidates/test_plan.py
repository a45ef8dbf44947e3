from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.robots import load_robot, load_scene
from plancurate.tasks.candidates.plan import plan_candidate, seed_of
from plancurate.tasks.candidates.settings import PlanSettings, TargetSettings
from plancurate.tasks.candidates.targets import sample_targets

ROBOT = load_robot("h2017")
SCENE = load_scene("table")
TARGET = sample_targets(ROBOT, SCENE, TargetSettings(), 1, 1)[0]
SETTINGS = PlanSettings()


def test_a_path_leads_from_home_to_the_goal_that_it_names():
    planned = plan_candidate(ROBOT, SCENE, TARGET, "RRTConnect", 0, SETTINGS)
    assert planned.result.status == "exact"
    assert np.array_equal(planned.result.path[0], ROBOT.home)
    np.testing.assert_allclose(planned.result.path[-1], TARGET.goals[planned.result.goal_index], atol=1e-9)


def test_a_run_repeats_exactly_and_the_next_one_differs():
    settings = PlanSettings(simplify=False)
    first, again, second = (plan_candidate(ROBOT, SCENE, TARGET, "RRT", run, settings) for run in (0, 0, 1))
    assert np.array_equal(first.result.path, again.result.path)
    assert first.seed == again.seed != second.seed
    assert not np.array_equal(first.result.path, second.result.path)


def test_a_spent_budget_is_an_outcome_not_an_error():
    planned = plan_candidate(ROBOT, SCENE, TARGET, "RRT", 0, PlanSettings(state_checks=1))
    assert planned.result.status != "exact"
    assert planned.result.reason
    assert planned.result.goal_index == -1


def test_parameters_reach_the_planner_and_wrong_ones_are_errors():
    bias = PlanSettings(params={"RRT": {"goal_bias": "0.9"}}, simplify=False)
    plain = plan_candidate(ROBOT, SCENE, TARGET, "RRT", 0, PlanSettings(simplify=False))
    biased = plan_candidate(ROBOT, SCENE, TARGET, "RRT", 0, bias)
    assert plain.result.state_checks != biased.result.state_checks
    with pytest.raises(PlancurateError, match=r"RRT.*goal_bias"):
        plan_candidate(ROBOT, SCENE, TARGET, "RRT", 0, PlanSettings(params={"RRT": {"goalbias": "1"}}))


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
    planned = plan_candidate(folded, SCENE, TARGET, "RRT", 0, SETTINGS)
    assert planned.result.status == "none"
    assert "start" in planned.result.reason
