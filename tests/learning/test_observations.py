from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import torch

from plancurate import native
from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.robots import Robot, load_robot, load_scene
from plancurate.tasks.candidates.targets import Target
from plancurate.tasks.lake.manifest import list_files
from plancurate.tasks.learning.demonstrations import demonstrations
from plancurate.tasks.learning.observations import layout, observe, state_at, term, term_names, width
from plancurate.tasks.learning.policies import TrainedPolicy, load_policy
from plancurate.tasks.learning.rollouts import Trials, roll_out
from plancurate.tasks.learning.settings import EvaluateSettings, TrainSettings
from plancurate.tasks.learning.test_targets import TargetsUnderTest, unseen_tests
from plancurate.tasks.learning.train import train

SCENE = load_scene("free")
BASIC = ("target_offset", "joint_positions")
SMALL = {"BC_MLP": {"hidden": (16,), "batch": 16}}
WAY_TO_GO = '''
"""How far the joints are from where the motion is to end."""
from plancurate.tasks.learning.observations import State, observation_term


@observation_term("way_to_go", size=lambda robot: robot.dof, needs_goal=True)
def way_to_go(state: State):
    """Goal minus present joint angles, rad."""
    return state.goal - state.q
'''


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("h2017")


def path_to(robot: Robot, direction: list[float], steps: int = 20) -> np.ndarray:
    return robot.home + np.linspace(0, 1, steps)[:, None] * np.array(direction)


def trained_on(
    robot: Robot, observation: tuple[str, ...], seeds: int = 1, **settings: object
) -> list[TrainedPolicy]:
    """Networks that learn one straight motion, seeing these terms."""
    path = path_to(robot, [0.3, -0.2, 0.2, 0.1, 0.2, 0.1])
    training = TrainSettings.model_validate(
        {"observation": observation, "policies": SMALL, "steps": 5} | settings
    )
    data = demonstrations(robot, SCENE, [path], native.fk(robot.native, path[-1:])[:, :3, 3], training)
    return train("BC_MLP", [data] * seeds, list(range(seeds)), training)


def at_ends(robot: Robot, *q: np.ndarray) -> TargetsUnderTest:
    positions = native.fk(robot.native, np.array(q))[:, :3, 3]
    return unseen_tests([Target(k, position, np.empty((0, 6))) for k, position in enumerate(positions)])


def test_terms_stand_side_by_side_in_the_order_asked_for(robot: Robot) -> None:
    rng = np.random.default_rng(0)
    q, before, target = (
        robot.home + rng.normal(0, 0.2, (4, 6)),
        np.tile(robot.home, (4, 1)),
        rng.normal(size=(4, 3)),
    )
    state = state_at(robot, SCENE, q, target, previous_q=before)
    seen = observe(("last_action", "target_offset", "joint_positions"), state)
    np.testing.assert_array_equal(seen[:, :6], q - before)
    np.testing.assert_array_equal(seen[:, 6:9], target - native.fk(robot.native, q)[:, :3, 3])
    np.testing.assert_array_equal(seen[:, 9:], q)
    parts = layout(("last_action", "target_offset"), robot)
    assert parts == (("last_action", 6), ("target_offset", 3))
    assert width(parts) == 9


def test_a_demonstration_and_a_rollout_of_it_observe_the_same(robot: Robot) -> None:
    terms = ("last_action", "target_offset", "joint_positions")
    path = path_to(robot, [0.3, -0.2, 0.2, 0.1, 0.2, 0.1])
    target = native.fk(robot.native, path[-1:])[:, :3, 3]
    data = demonstrations(
        robot, SCENE, [path, path[::2]], np.repeat(target, 2, 0), TrainSettings(observation=terms)
    )
    for start, way in zip(data.starts, (path, path[::2]), strict=True):
        trials = Trials(robot, SCENE, target, EvaluateSettings(), dt=0.1)
        for step in range(len(way) + 3):
            seen = observe(terms, trials.state)[0].astype(np.float32)
            np.testing.assert_array_equal(seen, data.observations[start + step])
            trials.move(way[min(step + 1, len(way) - 1)][None])
    assert not data.observations[data.starts, :6].any()


def test_the_action_is_added_to_the_joints_whatever_is_observed(robot: Robot) -> None:
    tests = at_ends(robot, robot.home + 0.2)
    for terms in (BASIC, ("joint_positions", "target_offset"), ("target_offset",)):
        policy = trained_on(robot, terms)[0]
        zero = {name: torch.zeros_like(value) for name, value in policy.weights.items()}
        still = replace(policy, weights=zero)
        trial = roll_out([still], robot, SCENE, tests, EvaluateSettings(max_steps=7), dt=0.1)[0]
        mean = policy.normaliser.action_mean.double().abs().sum().item()
        assert trial["joint_movement"][0].as_py() == pytest.approx(7 * mean, rel=1e-6)


def test_unknown_and_repeated_terms_are_one_line_errors() -> None:
    assert set(term_names()) >= {*BASIC, "last_action"}
    with pytest.raises(
        UnknownNameError, match="unknown observation term 'joint_position': did you mean joint_pos"
    ):
        TrainSettings(observation=("target_offset", "joint_position"))
    with pytest.raises(PlancurateError, match="term 'target_offset' is named twice"):
        TrainSettings(observation=("target_offset", "target_offset"))


def test_a_term_that_gives_another_number_of_columns_than_it_says_is_named(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(
        term._registry, "joint_positions", replace(term.find_term("joint_positions"), size=len)
    )
    wrong = replace(term.find_term("joint_positions"), size=lambda robot: 5)
    monkeypatch.setitem(term._registry, "joint_positions", wrong)
    home = robot.home[None]
    with pytest.raises(
        PlancurateError, match=r"'joint_positions' gives an array of shape \(1, 6\), .* \(1, 5\)"
    ):
        observe(BASIC, state_at(robot, SCENE, home, np.zeros((1, 3)), previous_q=home))


@pytest.mark.slow
def test_a_term_in_one_file_outside_the_package_is_trained_on_and_rolled_out(
    robot: Robot, tmp_path: Path, install: Callable[[str, ModuleType], None]
) -> None:
    install(WAY_TO_GO, term)
    assert "way_to_go" in term_names()
    policy = trained_on(robot, ("way_to_go",), steps=800, weight_decay=0, learning_rate=3e-3)[0]
    assert policy.layout == (("way_to_go", 6),)
    end = path_to(robot, [0.3, -0.2, 0.2, 0.1, 0.2, 0.1])[-1]
    tests, settings = at_ends(robot, end), EvaluateSettings(max_steps=40)
    policy.save(tmp_path / "policy")
    there, elsewhere = (
        roll_out([load_policy(tmp_path / "policy")], robot, SCENE, tests, settings, 0.1, goal[None, None])[0]
        for goal in (end, 2 * robot.home - end)
    )
    assert there["success"].to_pylist() == [True]
    assert elsewhere["success"].to_pylist() == [False]


def test_a_stored_policy_with_a_term_that_is_not_installed_is_refused(robot: Robot, tmp_path: Path) -> None:
    trained_on(robot, BASIC)[0].save(tmp_path)
    file = tmp_path / "policy.json"
    description = json.loads(file.read_text())
    assert description["observation"] == [["target_offset", 3], ["joint_positions", 6]]
    file.write_text(json.dumps(description | {"observation": [["target_ofset", 3], ["joint_positions", 6]]}))
    list_files(tmp_path, ("policy.json", "policy.safetensors"))
    with pytest.raises(UnknownNameError, match="unknown observation term 'target_ofset'"):
        term.find_term("target_ofset")
    with pytest.raises(
        PlancurateError, match=r"policy.json: unknown observation term 'target_ofset': did you mean"
    ):
        load_policy(tmp_path)
    file.write_text(json.dumps(description | {"observation": [["target_offset", 3]]}))
    list_files(tmp_path, ("policy.json", "policy.safetensors"))
    with pytest.raises(PlancurateError, match=r"has 9 numbers; the observation terms in policy.json give 3"):
        load_policy(tmp_path)


def test_a_policy_refuses_other_terms_and_a_robot_for_which_they_have_another_size(
    robot: Robot, robot_folders: dict[str, Path]
) -> None:
    policy, other = trained_on(robot, BASIC)[0], trained_on(robot, tuple(reversed(BASIC)))[0]
    tests, settings = at_ends(robot, robot.home), EvaluateSettings(max_steps=2)
    with pytest.raises(
        PlancurateError,
        match=r"BC_MLP was trained on the observation joint_positions \(6\), target_offset \(3\); target_offset \(3\)",
    ):
        roll_out([policy, other], robot, SCENE, tests, settings, dt=0.1)
    seven = load_robot(str(robot_folders["seven"]))
    with pytest.raises(PlancurateError, match=r"target_offset \(3\), joint_positions \(7\) can't be given"):
        roll_out([policy], seven, SCENE, tests, settings, dt=0.1)


def test_training_refuses_demonstrations_made_of_other_terms(robot: Robot) -> None:
    path = path_to(robot, [0.3] * 6)
    data = demonstrations(robot, SCENE, [path], np.zeros((1, 3)))
    with pytest.raises(PlancurateError, match="the settings ask for last_action"):
        train("BC_MLP", [data], [0], TrainSettings(observation=("last_action",), steps=1))
