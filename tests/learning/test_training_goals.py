"""Goal configurations of tested positions: chosen by the demonstrations around them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file

from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.robots import Robot, load_robot, load_scene
from plancurate.tasks.candidates.continued_goals import continued_goals
from plancurate.tasks.candidates.goals import tool_rotation
from plancurate.tasks.candidates.settings import TargetSettings
from plancurate.tasks.candidates.targets import Target, sample_targets
from plancurate.tasks.lake.manifest import list_files
from plancurate.tasks.learning.demonstrations import demonstrations
from plancurate.tasks.learning.observations import observe, state_at
from plancurate.tasks.learning.policies import TrainedPolicy, load_policy
from plancurate.tasks.learning.reach import goal_solutions
from plancurate.tasks.learning.rollouts import roll_out
from plancurate.tasks.learning.settings import EvaluateSettings, TrainSettings
from plancurate.tasks.learning.test_targets import unseen_tests
from plancurate.tasks.learning.train import train
from plancurate.tasks.learning.training_goals import (
    TrainingGoals,
    chosen_goals,
    training_goals,
)
from plancurate.tasks.motion.rollout import goals_of

SCENE = load_scene("free")
TERMS = ("target_offset", "joint_positions", "goal_offset")
DT = 0.05


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("h2017")


def along_x(*goals: tuple[float, list[float]]) -> TrainingGoals:
    """Training targets at these places on the x axis, m, with these goals."""
    positions = np.array([[x, 0.0, 0.0] for x, _ in goals])
    return TrainingGoals(positions, np.array([goal for _, goal in goals]))


def expected_at(x: float, *goals: tuple[float, list[float]]) -> list[float]:
    found: list[float] = along_x(*goals).at(np.array([[x, 0.0, 0.0]]))[0].tolist()
    return found


def test_the_goal_of_a_target_is_the_end_that_most_others_are_near_to() -> None:
    positions = np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 0], [0, 0, 0]])
    ends = np.array(
        [[0.0, 0], [9, 9], [3, 0], [0.5, 0]]
    )  # from the first target's: 3.5, 5.5 and 3 rad to the others
    found = training_goals(positions, ends)
    np.testing.assert_array_equal(found.positions, [[0, 0, 0], [1, 0, 0]])
    np.testing.assert_array_equal(found.configurations, [[0.5, 0], [9, 9]])


def test_neighbours_of_one_class_are_averaged_by_inverse_distance() -> None:
    near, far = (0.1, [0.0, 0.0]), (0.3, [0.8, -0.4])
    # weights 1/0.1 and 1/0.2 at x = 0.1 + 0.1: 2/3 and 1/3, and the fourth is no neighbour
    found = expected_at(0.0, (0.1, [0.0, 0.0]), (0.2, [0.6, -0.3]))
    assert found == pytest.approx([0.2, -0.1])
    third = expected_at(0.0, near, (0.2, [0.6, -0.3]), far, (5.0, [0.9, 0.0]))
    weights = np.array([10, 5, 10 / 3]) / (15 + 10 / 3)
    assert third == pytest.approx((weights @ np.array([[0, 0], [0.6, -0.3], [0.8, -0.4]])).tolist())


def test_where_neighbours_disagree_the_class_that_weighs_most_is_taken_and_never_a_mean() -> None:
    one, other, third = [0.0, 0.0], [2.0, 0.0], [2.2, 0.0]
    assert expected_at(0.0, (0.1, one), (0.2, other)) == one
    assert expected_at(0.0, (0.1, one), (0.2, other), (0.3, [0.0, 5.0])) == one
    two = expected_at(0.0, (0.1, one), (0.11, other), (0.12, third))
    assert 2.0 < two[0] < 2.2
    assert expected_at(0.0, (0.01, one), (0.11, other), (0.12, third)) == one


def test_a_position_at_a_training_target_takes_its_goal() -> None:
    assert expected_at(0.1, (0.1, [0.3]), (0.9, [0.9])) == pytest.approx([0.3], abs=1e-3)


def test_a_goal_continues_what_is_expected_so_that_near_positions_have_near_goals(robot: Robot) -> None:
    settings = TargetSettings(orientation="cone")
    here = native.fk(robot.native, robot.home[None])[0, :3, 3]
    shown = TrainingGoals(here[None], robot.home[None])
    positions = here + np.linspace(0, 0.1, 6)[:, None] * [0.0, 1.0, 0.0]
    goals = chosen_goals(shown, robot, SCENE, positions, settings, [(0, k) for k in range(6)])
    np.testing.assert_allclose(native.fk(robot.native, goals)[:, :3, 3], positions, atol=1e-6)
    np.testing.assert_allclose(goals[0], robot.home, atol=1e-6)
    assert np.linalg.norm(np.diff(goals, axis=0), axis=1).max() < 0.1


@pytest.mark.slow
def test_where_the_continued_goal_collides_one_near_it_is_chosen_and_out_of_reach_what_is_expected(
    robot: Robot,
) -> None:
    table, settings = load_scene("table"), TargetSettings(orientation="cone")
    targets = sample_targets(robot, table, settings, 0, 60)
    positions = np.array([target.position for target in targets])
    shown = TrainingGoals(positions[:1], targets[0].goals[:1])
    seeds = [(5, k) for k in range(len(targets))]
    expected = shown.at(positions)
    _, continued = continued_goals(robot, table, positions, expected, settings)
    goals = chosen_goals(shown, robot, table, positions, settings, seeds)
    assert 0 < continued.mean() < 1
    assert native.is_free(robot.native, table.native, goals).mean() > 0.9
    tool = native.fk(robot.native, goals)[:, :3, 3]
    np.testing.assert_allclose(tool[continued], positions[continued], atol=1e-6)
    far = np.array([[9.0, 0, 0]])
    np.testing.assert_array_equal(
        chosen_goals(shown, robot, table, far, settings, [(5, 0)]), targets[0].goals[:1]
    )


@pytest.mark.parametrize("orientation", ["exact", "yaw_free", "cone", "any"])
def test_solutions_are_free_reach_the_position_and_keep_the_tolerance(robot: Robot, orientation: str) -> None:
    table = load_scene("table")
    settings = TargetSettings.model_validate({"orientation": orientation})
    position = sample_targets(robot, table, settings, 0, 1)[0].position
    found = goal_solutions(robot, table, position, settings, (1000, 3))
    assert len(found) > 5 or orientation == "exact"
    assert native.is_free(robot.native, table.native, found).all()
    tool = native.fk(robot.native, found)
    np.testing.assert_allclose(tool[:, :3, 3], np.tile(position, (len(found), 1)), atol=1e-6)
    tilt = np.degrees(np.arccos(np.clip(tool[:, :3, 2] @ tool_rotation(robot, table)[:, 2], -1, 1))).max()
    assert tilt < {"exact": 1e-3, "yaw_free": 1e-3, "cone": 40.001, "any": 181}[orientation]
    np.testing.assert_array_equal(found, goal_solutions(robot, table, position, settings, (1000, 3)))


def line_to(robot: Robot, goal: np.ndarray) -> np.ndarray:
    """Straight in joint space, at half of the slowest joint's velocity limit."""
    steps = int(np.ceil(np.abs((goal - robot.home) / (0.5 * DT * robot.velocity)).max()))
    return robot.home + np.linspace(0, 1, steps + 1)[:, None] * (goal - robot.home)


def learnt(robot: Robot, targets: list[Target], terms: tuple[str, ...], steps: int = 1000) -> TrainedPolicy:
    """A network shown a straight motion to one of each target's goals: to the nearest, or to the next but one."""
    goals = [sorted(t.goals, key=lambda q: float(np.linalg.norm(q - robot.home))) for t in targets]
    paths = [line_to(robot, own[min(2 * (k % 2), len(own) - 1)]) for k, own in enumerate(goals)]
    training = TrainSettings(observation=terms, steps=steps, weight_decay=0.1)
    data = demonstrations(robot, SCENE, paths, np.array([t.position for t in targets]), training)
    return train("BC_MLP", [data], [0], training)[0]


@pytest.mark.training
def test_a_policy_that_knows_its_goal_is_not_torn_between_two(robot: Robot, tmp_path: Path) -> None:
    torch.set_num_threads(1)
    settings = TargetSettings(orientation="exact")
    targets = sample_targets(robot, SCENE, settings, 0, 40)
    tests = unseen_tests(sample_targets(robot, SCENE, settings, 100, 25))
    without, knowing = (learnt(robot, targets, terms) for terms in (TERMS[:2], TERMS))
    assert without.goals is None
    knowing.save(tmp_path / "policy")
    served = load_policy(tmp_path / "policy")
    assert served.goals is not None
    goals = goals_of(served, robot, SCENE, tests.position, settings, 9)
    assert goals is not None

    def rate(policy: TrainedPolicy, goals: np.ndarray | None) -> float:
        trials = roll_out([policy], robot, SCENE, tests, EvaluateSettings(), DT, goals)[0]
        return float(np.mean(trials["success"].to_numpy(zero_copy_only=False)))

    assert rate(without, None) < 0.3
    assert rate(served, goals[None]) > 0.7


@pytest.mark.slow
def test_each_policy_goes_to_its_own_goal(robot: Robot) -> None:
    targets = sample_targets(robot, SCENE, TargetSettings(), 0, 3)
    policy = learnt(robot, targets, ("goal_offset",), steps=600)
    tests = unseen_tests([Target(0, np.array([0.0, 0.0, 9.0]), np.empty((0, 6)))])
    goals = np.stack([robot.home + 0.3, robot.home - 0.3])[:, None]
    rows = roll_out([policy, policy], robot, SCENE, tests, EvaluateSettings(max_steps=20), DT, goals)
    alone = roll_out([policy], robot, SCENE, tests, EvaluateSettings(max_steps=20), DT, goals[1:])
    ends = [table["settled_distance"][0].as_py() for table in (*rows, *alone)]
    assert abs(ends[0] - ends[1]) > 0.05
    assert ends[1] == pytest.approx(ends[2])


def test_a_demonstration_shows_its_end_at_every_step(robot: Robot) -> None:
    targets = sample_targets(robot, SCENE, TargetSettings(), 0, 2)
    paths = [line_to(robot, target.goals[0]) for target in targets]
    training = TrainSettings(observation=("goal_offset", "joint_positions"))
    places = np.array([target.position for target in targets])
    data = demonstrations(robot, SCENE, paths, places, training, hold_steps=3)
    ends = np.repeat([path[-1] for path in paths], data.lengths, axis=0)
    np.testing.assert_allclose(data.observations.sum(axis=1), ends.sum(axis=1), rtol=1e-5)
    np.testing.assert_allclose(data.observations[:, :6] + data.observations[:, 6:], ends, atol=1e-6)
    assert data.goals is not None
    order = np.lexsort(places.T[::-1])
    np.testing.assert_array_equal(data.goals.configurations, np.array([path[-1] for path in paths])[order])


def test_a_term_that_needs_a_goal_is_refused_where_there_is_none(robot: Robot, tmp_path: Path) -> None:
    home = robot.home[None]
    with pytest.raises(PlancurateError, match="'goal_offset' needs a goal configuration and there is none"):
        observe(TERMS, state_at(robot, SCENE, home, np.zeros((1, 3)), previous_q=home))
    targets = sample_targets(robot, SCENE, TargetSettings(), 0, 2)
    policy = learnt(robot, targets, TERMS, steps=5)
    with pytest.raises(PlancurateError, match="'goal_offset' needs a goal configuration"):
        roll_out([policy], robot, SCENE, unseen_tests(targets), EvaluateSettings(max_steps=2), DT)
    replace(policy, goals=None).save(tmp_path / "none")
    with pytest.raises(PlancurateError, match=r"goals.positions is \(0,\).*'goal_offset' needs \(g, 3\) and"):
        load_policy(tmp_path / "none")
    policy.save(tmp_path / "short")
    tensors = load_file(tmp_path / "short" / "policy.safetensors")
    tensors["goals.configurations"] = tensors["goals.configurations"][:, :5].contiguous()
    save_file(tensors, tmp_path / "short" / "policy.safetensors")
    list_files(tmp_path / "short", ("policy.json", "policy.safetensors"))
    with pytest.raises(PlancurateError, match=r"goals.configurations \(2, 5\); .* \(g, 6\)"):
        load_policy(tmp_path / "short")


def test_goals_are_equal_by_content() -> None:
    one, same = along_x((0.3, [0.0, 1.0]), (0.5, [0.5, 1.0])), along_x((0.3, [0.0, 1.0]), (0.5, [0.5, 1.0]))
    other = along_x((0.3, [0.0, 1.0]), (0.5, [0.5, 1.5]))
    assert one == same
    assert one != other
    assert len({one, same, other}) == 2
