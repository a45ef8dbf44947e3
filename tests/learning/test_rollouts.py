from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pyarrow as pa
import pytest
import torch

from plancurate import native
from plancurate.robots import Robot, Scene, colliding_pairs, load_robot, load_scene
from plancurate.tasks.candidates.settings import GenerateSettings
from plancurate.tasks.candidates.targets import Target, sample_targets
from plancurate.tasks.learning import rollouts
from plancurate.tasks.learning.observations import observe
from plancurate.tasks.learning.policies import Normaliser, TrainedPolicy, make_policy
from plancurate.tasks.learning.rollouts import Trials, moves, roll_out
from plancurate.tasks.learning.settings import EvaluateSettings
from plancurate.tasks.learning.test_targets import displaced_tests, join_tests, reachable_tests, unseen_tests

NONE = np.empty((0, 6))
DT = 0.05
LAYOUT = (("target_offset", 3), ("joint_positions", 6))


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("h2017")


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene("free")


def tool(robot: Robot, q: np.ndarray) -> np.ndarray:
    return native.fk(robot.native, q)[:, :3, 3]


def trained(name: str, seed: int, drift: float = 0.02, action: str = "delta") -> TrainedPolicy:
    """An untrained network whose actions are `drift` rad a step or so."""
    policy = make_policy(name, {})
    weights = policy.initial(9, 6, torch.Generator().manual_seed(seed))
    scale = Normaliser(torch.zeros(9), torch.ones(9), torch.full((6,), drift), torch.full((6,), drift))
    return TrainedPolicy(policy, weights, scale, LAYOUT, action, window=4, seed=seed)


def reference(
    policy: TrainedPolicy, robot: Robot, scene: Scene, target: np.ndarray, settings: EvaluateSettings
) -> dict[str, object]:
    """One rollout, one step at a time, written for reading."""
    weights = {name: value[None] for name, value in policy.weights.items()}
    norm = policy.normaliser
    q, memory, failure = robot.home.copy(), None, "lost"
    place = tool(robot, q[None])[0]
    way, moved, steps, distance = 0.0, 0.0, 0, float(np.linalg.norm(target - place))
    reached, collided, outside, broken = distance < settings.reach_m, False, False, False
    for step in range(settings.max_steps):
        if step % policy.window == 0:
            memory = None
        seen = torch.from_numpy(np.concatenate([target - place, q])).float()
        seen = (seen - norm.observation_mean) / norm.observation_scale
        action, memory = policy.policy.step(weights, seen[None, None], memory)
        change = (action[0, 0] * norm.action_scale + norm.action_mean).double().detach().numpy()
        following = q + change if policy.action == "delta" else change
        fast = bool((np.abs(following - q) / DT > robot.velocity).any())
        out = fast or bool(((following < robot.lower) | (following > robot.upper)).any())
        hit = (
            not out
            and not native.edge_is_free(
                robot.native, scene.native, q[None], following[None], settings.resolution
            ).item()
        )
        if out or hit:
            broken = True
            outside, collided = outside or (out and not reached), collided or (hit and not reached)
            failure = "limits" if out else "collided"
            break
        after = tool(robot, following[None])[0]
        if not reached:
            way += float(np.linalg.norm(after - place))
            moved += float(np.abs(following - q).sum())
            steps += 1
            distance = float(np.linalg.norm(target - after))
            reached = distance < settings.reach_m
        q, place = following, after
    end = float(np.linalg.norm(target - place))
    return {
        "success": reached, "failure": "" if reached else failure, "collided": collided,
        "settled": not broken and end < settings.reach_m, "precise": not broken and end < settings.precise_m,
        "out_of_limits": outside, "steps": steps, "final_distance": distance, "settled_distance": end,
        "path_length": way, "joint_movement": moved,
    }  # fmt: skip


@pytest.mark.parametrize("name", ["BC_MLP", "BC_RNN", "BC_RNN_MDN"])
@pytest.mark.parametrize("action", ["delta", "absolute"])
def test_batched_rollout_equals_one_trial_at_a_time(robot: Robot, name: str, action: str) -> None:
    table = load_scene("table")
    policies = [trained(name, seed, 0.05, action) for seed in range(3)]
    goals = robot.home + np.linspace(-0.6, 0.6, 5)[:, None] * np.array([1.0, 1, -1, 0.5, -1, 1])
    tests = unseen_tests([Target(k, place, NONE) for k, place in enumerate(tool(robot, goals))])
    settings = EvaluateSettings(max_steps=60, reach_m=0.2)
    tables = roll_out(policies, robot, table, tests, settings, DT)
    rows = [row for table_ in tables for row in table_.to_pylist()]
    assert len({row["failure"] for row in rows}) > (action == "delta")
    expected = [
        reference(policy, robot, table, place, settings) for policy in policies for place in tests.position
    ]
    for row, other in zip(rows, expected, strict=True):
        for column, value in other.items():
            assert row[column] == pytest.approx(value, abs=1e-5), column


def test_what_a_policy_draws_is_drawn_by_the_seed_and_no_other(robot: Robot, scene: Scene) -> None:
    policy = trained("BC_RNN_MDN", 0, 0.05, "delta")
    drawing = replace(policy, policy=policy.policy.model_copy(update={"mode": "drawn"}))
    tests = unseen_tests([Target(0, tool(robot, robot.home[None])[0] + 0.3, NONE)])

    def rolled_out(seed: int) -> float:
        settings = EvaluateSettings(max_steps=20, seed=seed)
        (table,) = roll_out([drawing], robot, scene, tests, settings, DT)
        return float(table["joint_movement"][0].as_py())

    torch.manual_seed(5)
    first = rolled_out(0)
    drawn = torch.rand(1)
    assert rolled_out(0) == first != rolled_out(1)
    torch.manual_seed(5)
    assert torch.equal(torch.rand(1), drawn)  # nothing was taken from the caller's own draws


@dataclass(frozen=True)
class Told:
    """A trial whose moves are given."""

    robot: Robot
    scene: Scene
    target: np.ndarray
    dt: float = 1.0

    def run(self, states: Sequence[np.ndarray]) -> dict[str, object]:
        trials = Trials(self.robot, self.scene, self.target[None], EvaluateSettings(), self.dt)
        for q in states:
            trials.move(q[None])
        return {name: value.tolist()[0] for name, value in trials.columns().items()}


@pytest.fixture
def told(robot: Robot, scene: Scene) -> Told:
    return Told(robot, scene, tool(robot, robot.home[None] + [[0.3, 0, 0, 0, 0, 0]])[0])


def turn(robot: Robot, *angles: float) -> list[np.ndarray]:
    """Home with joint 1 turned by each angle."""
    return [robot.home + np.array([angle, 0, 0, 0, 0, 0]) for angle in angles]


def test_trial_that_passes_the_target_succeeds_but_does_not_settle(told: Told) -> None:
    trial = told.run(turn(told.robot, 0.1, 0.2, 0.3, 0.5, 0.9))
    assert (trial["success"], trial["settled"], trial["steps"]) == (True, False, 3)
    assert trial["joint_movement"] == pytest.approx(0.3)
    assert trial["final_distance"] == pytest.approx(0, abs=1e-9)
    assert trial["settled_distance"] > 0.3


def test_trial_that_stops_at_the_target_settles(told: Told) -> None:
    trial = told.run(turn(told.robot, 0.15, 0.29, 0.29, 0.31))
    assert (trial["success"], trial["settled"], trial["steps"]) == (True, True, 2)
    radius = np.linalg.norm(told.target[:2])
    assert trial["path_length"] == pytest.approx(2 * radius * (np.sin(0.15 / 2) + np.sin(0.14 / 2)), rel=1e-3)


def test_trial_that_never_comes_near_fails_at_the_step_limit(told: Told) -> None:
    trial = told.run(turn(told.robot, -0.1, -0.2, -0.3))
    assert (trial["success"], trial["settled"], trial["collided"], trial["out_of_limits"]) == (False,) * 4
    assert trial["steps"] == 3
    assert trial["final_distance"] == trial["settled_distance"]


@pytest.mark.parametrize("wrong", [np.full(6, 99.0), np.full(6, np.nan), np.full(6, np.inf)])
def test_trial_that_leaves_the_limits_stays_where_it_was_and_has_failed(
    told: Told, wrong: np.ndarray
) -> None:
    trial = told.run([*turn(told.robot, 0.1), wrong, *turn(told.robot, 0.3)])
    assert (trial["success"], trial["settled"], trial["out_of_limits"]) == (False, False, True)
    assert trial["steps"] == 1
    assert trial["joint_movement"] == pytest.approx(0.1)
    assert trial["settled_distance"] == trial["final_distance"]


def test_trial_that_collides_between_two_free_states_fails(told: Told) -> None:
    robot, scene = told.robot, load_scene("table")
    drawn = np.random.default_rng(0).uniform(robot.lower, robot.upper, (2000, robot.dof))
    free = native.is_free(robot.native, scene.native, drawn)
    homes = np.tile(robot.home, (len(drawn), 1))
    way_free = native.edge_is_free(robot.native, scene.native, homes, drawn, 0.05)
    beyond = drawn[free & ~way_free][0]
    trial = Told(robot, scene, tool(robot, beyond[None])[0], dt=10.0).run([beyond])
    assert (trial["success"], trial["collided"], trial["out_of_limits"]) == (False, True, False)
    assert trial["joint_movement"] == 0


def test_what_moves_no_more_is_observed_no_more(
    robot: Robot, scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    policies = [trained("BC_MLP", 0, drift=9.0), trained("BC_MLP", 1, drift=1e-3)]  # far too fast, and slow
    observed: list[int] = []
    monkeypatch.setattr(
        rollouts, "observe", lambda terms, state: (observed.append(len(state.q)), observe(terms, state))[1]
    )
    place, settings = tool(robot, robot.home[None]) + 1.0, EvaluateSettings(max_steps=5)
    assert [trials.stopped.tolist() for trials in moves(policies, robot, scene, place, settings, DT)] == [
        [False, False], *[[True, False]] * 5,
    ]  # fmt: skip
    assert observed == [2, 1, 1, 1, 1, 1]
    observed.clear()
    assert len(list(moves(policies[:1], robot, scene, place, settings, DT))) == 2
    assert observed == [1]


def test_a_move_faster_than_a_joint_may_turn_breaks_a_limit(robot: Robot, scene: Scene) -> None:
    target = tool(robot, robot.home[None] + [[0.3, 0, 0, 0, 0, 0]])[0]
    step = robot.velocity[0] * 0.05
    slow = Told(robot, scene, target, dt=0.05).run(turn(robot, 0.999 * step, 0.0))
    assert (slow["failure"], slow["steps"]) == ("lost", 2)
    fast = Told(robot, scene, target, dt=0.05).run(turn(robot, 0.5 * step, -0.501 * step, 0.3))
    assert (fast["failure"], fast["failure_detail"], fast["steps"]) == ("limits", "joint_1 velocity", 1)
    assert fast["out_of_limits"]
    assert not fast["success"]


def test_the_joint_farthest_over_a_limit_is_named(told: Told) -> None:
    robot = told.robot

    def detail(q: np.ndarray) -> object:
        return replace(told, dt=0.05).run([q])["failure_detail"]

    beyond = robot.home.copy()
    beyond[[1, 2]] = robot.upper[[1, 2]] + [0.1, 0.2]
    assert detail(beyond) == "joint_3 position"  # faster than any joint may as well
    assert (
        detail(robot.home + np.array([0, 0.2, 0, 0, 0.3, 0])) == "joint_2 velocity"
    )  # 2.9 times; joint 5: 1.9 times
    assert detail(robot.home + np.array([0, 0, 0, np.nan, 0, 0])) == "joint_4 position"


def test_a_collision_names_what_is_met_first_on_the_way(robot: Robot, scene: Scene) -> None:
    down = robot.home.copy()
    down[1:3] = robot.upper[1:3]
    steps = np.linspace(robot.home, down, 200)
    first = next(q for q in steps if not native.is_free(robot.native, scene.native, q[None])[0])
    assert colliding_pairs(robot, scene, first) != colliding_pairs(robot, scene, down)
    trial = Told(robot, scene, tool(robot, down[None])[0], dt=10.0).run([down])
    assert trial["failure"] == "collided"
    assert trial["failure_detail"] in colliding_pairs(robot, scene, first)


def test_precise_asks_for_a_centimetre_at_the_end_and_no_rule_broken(told: Told) -> None:
    near, far = 0.3 - 0.008 / np.linalg.norm(told.target[:2]), 0.3 - 0.012 / np.linalg.norm(told.target[:2])
    for angles, precise in (((near,), True), ((far,), False), ((near, far), False), ((far, near), True)):
        trial = told.run(turn(told.robot, *angles))
        assert (trial["settled"], trial["precise"]) == (True, precise)
    spoilt = told.run([*turn(told.robot, 0.3), np.full(6, 99.0)])
    assert (spoilt["success"], spoilt["precise"], spoilt["failure"]) == (True, False, "")


def test_rule_broken_after_reaching_spoils_settling_alone(told: Told) -> None:
    trial = told.run([*turn(told.robot, 0.3), np.full(6, 99.0), *turn(told.robot, 0.3)])
    assert (trial["success"], trial["settled"], trial["out_of_limits"]) == (True, False, False)
    assert trial["settled_distance"] < 0.05


def test_memory_is_reset_every_window(robot: Robot, scene: Scene) -> None:
    tests = unseen_tests([Target(0, np.array([0.0, 0.0, 9.0]), NONE)])

    def way(policy: TrainedPolicy, steps: int) -> float:
        rows: pa.Table = roll_out([policy], robot, scene, tests, EvaluateSettings(max_steps=steps), DT)[0]
        return float(rows["joint_movement"][0].as_py())

    policy = trained("BC_RNN", 0, 0.01)
    never = replace(policy, window=1000)
    assert way(policy, 4) == way(never, 4)
    assert abs(way(policy, 6) - way(never, 6)) > 1e-6


def test_five_targets_give_eighty_displaced_tests(robot: Robot) -> None:
    targets = [Target(k, np.array([0.1 * k, 0.2, 0.3]), NONE) for k in range(5)]
    tests = displaced_tests(targets, seed=3)
    assert len(tests) == 80
    assert np.bincount(tests.distance_cm).tolist() == [5, 15, 15, 15, 15, 15]
    places = np.array([targets[k].position for k in tests.target_id])
    moved = np.linalg.norm(tests.position - places, axis=1)
    np.testing.assert_allclose(moved, tests.distance_cm / 100, atol=1e-12)
    directions = (tests.position - places)[tests.distance_cm > 0]
    assert len(np.unique(directions.round(9), axis=0)) == 75


def test_tests_of_a_target_depend_on_it_and_the_seed_alone() -> None:
    first, second = (Target(k, np.array([0.1, 0.2, 0.3 * k]), NONE) for k in (4, 5))
    both, one = displaced_tests([first, second], 3), displaced_tests([second], 3)
    np.testing.assert_array_equal(both.position[16:], one.position)
    assert not np.array_equal(one.position[1:], displaced_tests([second], 4).position[1:])


@pytest.mark.slow
def test_displaced_tests_that_no_planner_reaches_are_left_out_and_the_others_keep_their_numbers(
    robot: Robot, scene: Scene
) -> None:
    far = Target(0, np.array([0.0, 0.0, 9.0]), NONE)
    near = Target(1, np.array([0.75, -0.13, 1.14]), NONE)
    settings = GenerateSettings()
    tests = join_tests(displaced_tests([far, near], 3), unseen_tests([far, near]))
    kept = reachable_tests(tests, robot, [scene] * len(tests), settings, seed=3)
    assert kept.test_id.tolist() == list(range(16, 34))
    np.testing.assert_array_equal(kept.position, tests.position[16:])
    assert kept.target_id.tolist() == [1] * 16 + [0, 1]
    assert kept.hard is not None
    assert kept.hard.tolist() == [False] * 16 + [True, False]
    rows = roll_out([trained("BC_MLP", 0)], robot, scene, kept, EvaluateSettings(max_steps=2), DT)[0]
    assert rows["test_id"].to_pylist() == list(range(16, 34))
    assert rows["hard"].to_pylist() == kept.hard.tolist()


def test_a_test_is_hard_where_the_straight_line_to_the_nearest_goal_is_not_free(robot: Robot) -> None:
    table, settings = load_scene("table"), GenerateSettings()
    targets = sample_targets(robot, table, settings.targets, 0, 12)
    found = reachable_tests(unseen_tests(targets), robot, [table] * len(targets), settings, seed=8).hard
    assert found is not None
    expected = []
    for target in targets:  # its goals come from another draw
        nearest = min(target.goals, key=lambda goal: float(np.linalg.norm(goal - robot.home)))
        line = np.linspace(robot.home, nearest, 500)
        expected.append(not native.is_free(robot.native, table.native, line).all())
    assert found.tolist() == expected
    assert set(expected) == {False, True}


def test_unseen_tests_have_no_distance_in_their_rows(robot: Robot, scene: Scene) -> None:
    targets = [Target(9, np.array([0.5, 0.2, 0.9]), NONE)]
    tests = join_tests(displaced_tests(targets, 0), unseen_tests(targets))
    rows = roll_out([trained("BC_MLP", 0)], robot, scene, tests, EvaluateSettings(max_steps=3), DT)[0]
    assert rows["test_id"].to_pylist() == list(range(17))
    assert rows["kind"].to_pylist() == ["displaced"] * 16 + ["unseen"]
    assert rows["distance_cm"].to_pylist() == [0, *np.repeat(range(1, 6), 3).tolist(), None]
    assert rows["target_id"].to_pylist() == [9] * 17


def test_policies_side_by_side_move_as_each_does_alone(robot: Robot, scene: Scene) -> None:
    policies = [trained("BC_RNN", seed, 0.02) for seed in range(3)]
    tests = displaced_tests([Target(0, np.array([0.8, 0.1, 0.8]), NONE)], 0)
    settings = EvaluateSettings(max_steps=30)
    together = roll_out(policies, robot, scene, tests, settings, DT)
    for policy, rows in zip(policies, together, strict=True):
        alone = roll_out([policy], robot, scene, tests, settings, DT)[0]
        for column in ("settled_distance", "joint_movement"):
            np.testing.assert_allclose(rows[column].to_numpy(), alone[column].to_numpy(), rtol=1e-6)
