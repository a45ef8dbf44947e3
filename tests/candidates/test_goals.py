from itertools import pairwise

import numpy as np
import pytest

from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.robots import load_robot, load_scene
from plancurate.tasks.candidates.goals import (
    cone_axes,
    planning_scene,
    run_goals,
    tool_rotation,
    turn_between,
)
from plancurate.tasks.candidates.plan import plan_candidate
from plancurate.tasks.candidates.settings import GenerateSettings, PlanSettings, TargetSettings
from plancurate.tasks.candidates.targets import Target, sample_targets

ROBOT, TABLE = load_robot("h2017"), load_scene("table")
DOWN = tool_rotation(ROBOT, TABLE)[:, 2]


def tilts(goals):
    """Angle (k,) of the tool's axis from the home tool's, rad."""
    return np.arccos(np.clip(native.fk(ROBOT.native, goals)[:, :3, 2] @ DOWN, -1, 1))


def spread(goals):
    """Greatest turn of the tool about its own axis between two goals, rad."""
    x = native.fk(ROBOT.native, goals)[:, :3, 0]
    return np.arccos(np.clip(x @ x.T, -1, 1)).max()


@pytest.mark.parametrize(
    ("orientation", "least", "most"), [("exact", 0, 1e-6), ("yaw_free", 0, 1e-6), ("cone", 0.2, 0.5), ("any", 1, np.pi)]
)  # fmt: skip
def test_goals_keep_the_orientation_tolerance_and_use_it(orientation, least, most):
    settings = TargetSettings(orientation=orientation, cone_deg=np.degrees(0.5))
    for target in sample_targets(ROBOT, TABLE, settings, 0, 4):
        tools = native.fk(ROBOT.native, target.goals)[:, :3, 3]
        assert np.abs(tools - target.position).max() < 1e-6
        assert native.is_free(ROBOT.native, TABLE.native, target.goals).all()
        assert least <= tilts(target.goals).max() <= most + 1e-6
        assert (spread(target.goals) > 1) == (orientation != "exact")


def test_cone_axes_fill_the_cone_evenly():
    axes = cone_axes(tool_rotation(ROBOT, TABLE), 0.7, np.random.default_rng(0), 20_000)
    cosines = axes @ DOWN
    np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1)
    assert cosines.min() >= np.cos(0.7) - 1e-12
    # On a sphere the area of a cap grows with its height.
    quarters = 1 - (1 - np.cos(0.7)) * np.array([0.75, 0.5, 0.25])
    np.testing.assert_allclose(np.quantile(cosines, [0.25, 0.5, 0.75]), quarters, atol=0.01)


@pytest.mark.parametrize("b", [[0, 0, 1], [0, 0, -1], [1, 0, 0], [0.6, 0, -0.8]])
def test_the_smallest_turn_between_directions(b):
    turn = turn_between(np.array([0.0, 0, 1]), np.array(b, dtype=float))
    np.testing.assert_allclose(turn @ [0, 0, 1], b, atol=1e-12)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1)
    assert np.trace(turn) == pytest.approx(1 + 2 * b[2])


def goals_of(seed, orientation="yaw_free", **plan):
    settings = GenerateSettings(targets=TargetSettings(orientation=orientation), plan=PlanSettings(**plan))
    target = sample_targets(ROBOT, TABLE, settings.targets, 0, 1)[0]
    return target, run_goals(ROBOT, planning_scene(TABLE, settings.plan), target, seed, settings)


def test_each_run_draws_its_own_goals_and_draws_them_again():
    (target, first), (_, again), (_, second) = (
        goals_of(seed, goals="pose", goal_draws=3) for seed in (1, 1, 2)
    )
    assert first.shape == (3, 6)
    assert np.array_equal(first, again)
    assert not np.isin(first, second).any()
    assert np.abs(native.fk(ROBOT.native, first)[:, :3, 3] - target.position).max() < 1e-6
    assert tilts(first).max() < 1e-6
    assert native.is_free(ROBOT.native, TABLE.native, first).all()


def test_goals_without_tolerance_are_drawn_from_the_target_s_own():
    settings = GenerateSettings(
        targets=TargetSettings(orientation="exact"), plan=PlanSettings(goals="pose", goal_draws=1)
    )
    target = max(sample_targets(ROBOT, TABLE, settings.targets, 0, 8), key=lambda target: len(target.goals))
    drawn = [run_goals(ROBOT, TABLE, target, seed, settings) for seed in range(12)]
    assert len(target.goals) >= 2
    assert all((goals[:, None] == target.goals).all(axis=2).any(axis=1).all() for goals in drawn)
    assert all(len(np.unique(goals, axis=0)) == len(goals) for goals in drawn)
    assert len({goals.tobytes() for goals in drawn}) == len(target.goals)


def test_the_nearest_goal_is_the_same_for_all_runs():
    (target, one), (_, other) = (goals_of(seed, goals="nearest") for seed in (1, 2))
    assert np.array_equal(one, other)
    distances = np.linalg.norm(target.goals - ROBOT.home, axis=1)
    assert np.linalg.norm(one[0] - ROBOT.home) == distances.min() < distances.max()


def test_all_goals_are_those_of_the_target():
    target, goals = goals_of(5, orientation="exact")
    assert np.array_equal(goals, target.goals)


def test_paths_end_within_the_tolerance_at_goals_that_differ_from_run_to_run():
    settings = GenerateSettings(
        targets=TargetSettings(orientation="cone", cone_deg=30), plan=PlanSettings(goals="pose")
    )
    target = sample_targets(ROBOT, TABLE, settings.targets, 0, 1)[0]
    ends = np.array(
        [plan_candidate(ROBOT, TABLE, target, "RRTConnect", run, settings).path[-1] for run in range(8)]
    )
    assert np.abs(native.fk(ROBOT.native, ends)[:, :3, 3] - target.position).max() < 1e-6
    assert tilts(ends).max() <= np.radians(30) + 1e-6
    assert len(np.unique(ends.round(6), axis=0)) == 8


@pytest.mark.slow
def test_paths_keep_the_clearance_that_is_asked_for():
    wide, narrow = (GenerateSettings(plan=PlanSettings(clearance_m=clearance)) for clearance in (0.04, 0.0))

    def nearest(settings):
        """Distance from the obstacles alone, over paths to a few targets."""
        targets = sample_targets(ROBOT, planning_scene(TABLE, settings.plan), settings.targets, 0, 12)
        paths = [plan_candidate(ROBOT, TABLE, target, "RRTConnect", 0, settings).path for target in targets]
        states = [np.linspace(a, b, 200) for path in paths for a, b in pairwise(path)]
        return native.clearance(ROBOT.native_without_pairs, TABLE.native, np.concatenate(states)).min()

    assert nearest(narrow) < 0.03 < 0.04 < nearest(wide)
    assert (
        native.clearance(ROBOT.native, TABLE.native, ROBOT.home[None])[0] < 0.045
    )  # its own links are nearer


def test_a_target_that_only_less_clearance_reaches_is_a_run_with_its_reason():
    settings = GenerateSettings(plan=PlanSettings(clearance_m=0.3))
    low = Target(
        0, np.array([0.7, 0.0, 0.75]), sample_targets(ROBOT, TABLE, settings.targets, 0, 1)[0].goals[:0]
    )
    planned = plan_candidate(ROBOT, TABLE, low, "RRTConnect", 0, settings)
    assert (planned.status, planned.termination) == ("none", "goal")
    assert "no goal configuration" in planned.reason


@pytest.mark.slow
def test_robots_with_few_joints_reach_targets_whose_orientation_is_free(robot_folders):
    scara, free = load_robot(robot_folders["scara"]), load_scene("free")
    with pytest.raises(PlancurateError, match="orientation=cone; another range, orientation"):
        sample_targets(scara, free, TargetSettings(orientation="cone", range_m=0.2, max_tries=5), 0, 1)
    for orientation in ("yaw_free", "any"):
        targets = sample_targets(scara, free, TargetSettings(orientation=orientation, range_m=0.2), 0, 3)
        for target in targets:
            tools = native.fk(scara.native, target.goals)[:, :3, 3]
            assert np.abs(tools - target.position).max() < 1e-6
