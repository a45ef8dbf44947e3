"""Corrections of policies that fail at known states."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import torch

from plancurate import native
from plancurate.robots import Robot, Scene, load_robot, load_scene
from plancurate.tasks.candidates.relaxed import subdivided
from plancurate.tasks.candidates.settings import PlanSettings
from plancurate.tasks.learning import corrections as module
from plancurate.tasks.learning.corrections import (
    UNSETTLED,
    Correction,
    chosen_steps,
    corrections,
    planned,
    shortest,
)
from plancurate.tasks.learning.demonstrations import Demonstrations, demonstrations, limited_share
from plancurate.tasks.learning.policies import Normaliser, TrainedPolicy, make_policy
from plancurate.tasks.learning.policies.batches import Batches, normaliser
from plancurate.tasks.learning.settings import CorrectionSettings, EvaluateSettings, TrainSettings
from plancurate.tasks.learning.training_goals import TrainingGoals

from ..relaxing import cost

DT = 0.05
TURN = np.array([0.05, 0, 0, 0, 0, 0])
LAYOUT = (("target_offset", 3), ("joint_positions", 6))
PLANNING = PlanSettings(clearance_m=0.03)


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("h2017")


@pytest.fixture(scope="module")
def table() -> Scene:
    return load_scene("table")


def turning(step: np.ndarray) -> TrainedPolicy:
    """A network that makes the same move whatever it sees."""
    policy = make_policy("BC_MLP", {})
    weights = policy.initial(9, 6, torch.Generator().manual_seed(0))
    still = {name: torch.zeros_like(value) for name, value in weights.items()}
    scale = Normaliser(torch.zeros(9), torch.ones(9), torch.tensor(step).float(), torch.ones(6))
    return TrainedPolicy(policy, still, scale, LAYOUT, "delta", window=4, seed=0)


def goals_at(robot: Robot, *q: np.ndarray) -> TrainingGoals:
    configurations = np.stack(q)
    return TrainingGoals(native.fk(robot.native, configurations)[:, :3, 3], configurations)


def corrected(
    robot: Robot,
    scene: Scene,
    training: TrainingGoals,
    step: np.ndarray = TURN,
    seed: int = 0,
    evaluation: dict[str, Any] | None = None,
    **settings: int,
) -> list[Correction]:
    return corrections(
        turning(step),
        robot,
        scene,
        training,
        PLANNING.model_copy(update={"seed": seed}),
        EvaluateSettings(**(evaluation or {})),
        CorrectionSettings(rounds=1, **settings),
        DT,
    )


def test_a_policy_that_runs_into_a_limit_is_shown_the_way_from_there_and_from_before(robot: Robot) -> None:
    goal = robot.home - 8 * TURN
    last = int((robot.upper[0] - robot.home[0]) / TURN[0])
    found = corrected(robot, load_scene("free"), goals_at(robot, goal), states_a_failure=4)
    assert [one.failure for one in found] == ["limits"] * 4
    assert [one.step for one in found] == [-(-last * share // 4) for share in (1, 2, 3, 4)]
    for one in found:
        np.testing.assert_allclose(one.path[0], robot.home + one.step * TURN, atol=1e-5)
        np.testing.assert_array_equal(one.path[-1], goal)


def test_a_policy_that_collides_is_shown_a_free_way_that_ends_at_the_training_goal(
    robot: Robot, table: Scene
) -> None:
    down = np.array([0, 0, 0.04, 0, 0, 0])
    goal = robot.home + 10 * TURN
    found = corrected(robot, table, goals_at(robot, goal), down)
    assert {one.failure for one in found} == {"collided"}
    assert len(found) == CorrectionSettings().states_a_failure
    for one in found:
        np.testing.assert_array_equal(one.path[-1], goal)
        assert native.edge_is_free(robot.native, table.native, one.path[:-1], one.path[1:], 0.01).all()
    grown, last = table.grown(PLANNING.clearance_m), found[-1].path
    assert not native.is_free(
        robot.native, grown.native, last[:1]
    ).any()  # the clearance gave way there alone
    assert native.edge_is_free(robot.native, grown.native, found[0].path[:-1], found[0].path[1:], 0.01).all()


def test_a_rollout_that_settles_gives_few_states_and_one_that_leaves_again_is_a_failure(robot: Robot) -> None:
    near = goals_at(robot, robot.home + 10 * TURN)
    free = load_scene("free")
    settled = corrected(robot, free, near, evaluation={"max_steps": 10}, states_a_success=1)
    assert [(one.step, one.failure) for one in settled] == [(5, "")]
    assert corrected(robot, free, near, evaluation={"max_steps": 10}, states_a_success=0) == []
    left = corrected(robot, free, near, evaluation={"max_steps": 40}, states_a_failure=2)
    assert [(one.step, one.failure) for one in left] == [(20, UNSETTLED), (40, UNSETTLED)]


def test_a_rollout_that_never_moves_gives_no_state() -> None:
    assert len(chosen_steps(np.zeros((9, 6)), 4, whole=True)) == 0


def test_of_several_plans_the_shortest_is_kept(robot: Robot) -> None:
    start, goal = robot.home - 25 * TURN, robot.home + 25 * TURN
    wall = load_scene("passage", robot)
    paths = list(planned(robot, wall, start, goal, PLANNING, (0, 1), 6))
    lengths = [np.linalg.norm(np.diff(path, axis=0), axis=1).sum() for path in paths]
    assert max(lengths) > min(lengths) + 1e-3
    best = shortest(robot, (wall,), start, goal, PLANNING, (0, 1), 6)
    assert best is not None
    np.testing.assert_array_equal(best, paths[int(np.argmin(lengths))])


def test_corrections_are_relaxed_where_the_pool_s_paths_are(robot: Robot) -> None:
    start, goal = robot.home - 25 * TURN, robot.home + 25 * TURN
    wall = load_scene("passage", robot)
    kept, asked = wall.grown(0.03), PLANNING.model_copy(update={"simplification": "relaxed"})
    short, easy = (
        shortest(robot, (kept, wall), start, goal, planning, (0, 1), 4) for planning in (PLANNING, asked)
    )
    assert short is not None
    assert easy is not None
    np.testing.assert_array_equal(easy[[0, -1]], short[[0, -1]])
    before, after = (cost(robot, wall, q[:-1], q[1:]).sum() for q in (subdivided(short), easy))
    assert after < before
    assert native.edge_is_free(robot.native, kept.native, easy[:-1], easy[1:], 0.01).all()


def test_corrections_are_planned_with_the_clearance(
    robot: Robot, table: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Scene] = []

    def spy(robot: Robot, scene: Scene, *rest: Any) -> Any:
        asked.append(scene)
        return planned(robot, scene, *rest)

    monkeypatch.setattr(module, "planned", spy)
    found = corrected(robot, table, goals_at(robot, robot.home + 10 * TURN), np.array([0, 0, 0.04, 0, 0, 0]))
    without = [scene is table for scene in asked]
    assert len(found) == 4
    assert without == [False] * 4 + [True]  # the last state alone is nearer to the table


def test_the_same_arguments_give_the_same_corrections(robot: Robot, table: Scene) -> None:
    goals = goals_at(robot, robot.home + 10 * TURN, robot.home - 12 * TURN)
    down = np.array([0, 0, 0.04, 0, 0, 0])
    one, other = (corrected(robot, table, goals, down) for _ in range(2))
    assert [(c.target, c.step) for c in one] == [(c.target, c.step) for c in other]
    for a, b in zip(one, other, strict=True):
        np.testing.assert_array_equal(a.path, b.path)


def steps_of(robot: Robot, *lengths: int) -> Demonstrations:
    """Demonstrations of these many waypoints."""
    paths = [robot.home + np.arange(m)[:, None] * TURN for m in lengths]
    ends = native.fk(robot.native, np.stack([path[-1] for path in paths]))[:, :3, 3]
    return demonstrations(robot, load_scene("free"), paths, ends, TrainSettings(), hold_steps=0)


@pytest.mark.parametrize("most", [0.2, 0.5])
def test_corrections_are_never_more_than_their_share_of_what_is_drawn(robot: Robot, most: float) -> None:
    data = steps_of(robot, 10, 10, 30, 50)
    limited = limited_share(data, np.array([False, False, True, True]), most)
    kind, settings = make_policy("BC_MLP", {}), TrainSettings()
    norm = normaliser(limited, "delta")
    batches = Batches(kind, [limited], [norm], [0], "delta", settings.window, torch.device("cpu"))
    drawn = np.concatenate([batches._draw_windows(0) for _ in range(20)])
    assert np.mean(drawn >= 20) == pytest.approx(most, abs=0.01)
    assert np.bincount(drawn).min() > 0


def test_corrections_below_their_share_are_drawn_like_all_others(robot: Robot) -> None:
    data = steps_of(robot, 30, 50, 10)
    assert limited_share(data, np.array([False, False, True]), 0.2) is data
    assert limited_share(data, np.zeros(3, dtype=bool), 0.2) is data
