from __future__ import annotations

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
from plancurate.tasks.learning.demonstrations import Demonstrations, demonstrations
from plancurate.tasks.learning.policies import load_policy, make_policy, policy_names
from plancurate.tasks.learning.policies import policy as policy_registry
from plancurate.tasks.learning.policies.batches import Batches, normaliser, standardised
from plancurate.tasks.learning.policies.trained import TrainedPolicy
from plancurate.tasks.learning.rollouts import roll_out
from plancurate.tasks.learning.settings import EvaluateSettings, TrainSettings
from plancurate.tasks.learning.test_targets import unseen_tests
from plancurate.tasks.learning.train import learning_rate, train

pytestmark = pytest.mark.training

SCENE = load_scene("free")
NAMES = ["BC_MLP", "BC_RNN", "BC_RNN_Dropout", "BC_RNN_MDN"]
SMALL = {
    "BC_MLP": {"hidden": (32, 32), "batch": 32},
    "BC_RNN": {"hidden": 32, "batch": 16},
    "BC_RNN_Dropout": {"hidden": 32, "batch": 16},
    "BC_RNN_MDN": {"hidden": 32, "batch": 16},
}


@pytest.fixture(scope="module", autouse=True)
def one_thread() -> None:
    torch.set_num_threads(1)


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("h2017")


def path_to(robot: Robot, direction: list[float], steps: int = 25) -> np.ndarray:
    """Joint path (steps, n) that speeds up and slows down along a direction from home."""
    way = 0.5 - 0.5 * np.cos(np.linspace(0, np.pi, steps))
    return robot.home + way[:, None] * np.array(direction)


def one_path(robot: Robot, direction: list[float]) -> Demonstrations:
    path = path_to(robot, direction)
    return demonstrations(robot, SCENE, [path], native.fk(robot.native, path[-1:])[:, :3, 3], hold_steps=10)


def same(one: TrainedPolicy, other: TrainedPolicy) -> bool:
    return all(torch.equal(value, other.weights[name]) for name, value in one.weights.items())


UP, ASIDE = [0.1, -0.4, 0.3, 0.0, 0.2, 0.1], [0.5, 0.2, -0.1, 0.1, 0.0, 0.3]


@pytest.mark.parametrize("action", ["delta", "absolute"])
@pytest.mark.parametrize("name", ["BC_MLP", "BC_RNN"])
def test_one_trajectory_is_memorised_and_ends_within_a_centimetre(
    robot: Robot, name: str, action: str
) -> None:
    data = one_path(robot, UP)
    settings = TrainSettings(steps=1500, weight_decay=0, learning_rate=3e-3, action=action, policies=SMALL)
    trained = train(name, [data], [0], settings)
    assert trained[0].loss_curve[-1][1] < 1e-3
    goal = native.fk(robot.native, path_to(robot, UP)[-1:])[0, :3, 3]
    tests = unseen_tests([Target(0, goal, np.empty((0, 6)))])
    trial = roll_out(trained, robot, SCENE, tests, EvaluateSettings(max_steps=40), dt=0.1)[0].to_pylist()[0]
    assert trial["success"]
    assert trial["settled_distance"] < 0.01


@pytest.mark.parametrize("name", NAMES)
def test_a_network_trained_alone_is_bitwise_the_one_trained_in_a_stack(robot: Robot, name: str) -> None:
    settings = TrainSettings(steps=60, policies=SMALL)
    data, other = one_path(robot, UP), one_path(robot, ASIDE)
    alone = train(name, [data], [7], settings)[0]
    stack = train(name, [other, data, other, data, data], [0, 7, 7, 1, 7], settings)
    assert same(alone, stack[1])
    assert same(alone, stack[4])
    assert not same(alone, stack[3])
    assert not same(alone, stack[2])
    assert alone.loss_curve == stack[1].loss_curve


def test_loss_falls_and_every_step_is_told(robot: Robot) -> None:
    told: list[int] = []
    settings = TrainSettings(steps=120, policies=SMALL)
    trained = train("BC_RNN", [one_path(robot, UP)], [0], settings, told.append)[0]
    steps, losses = zip(*trained.loss_curve, strict=True)
    assert list(steps) == told == sorted(told)
    assert told[-1] == 120
    assert losses[-1] < 0.2 * losses[0]


def test_only_listed_window_starts_are_learnt_from(robot: Robot) -> None:
    data = one_path(robot, UP)
    first = replace(data, window_starts=np.array([0]))
    poisoned = replace(first, actions=data.actions.copy(), observations=data.observations.copy())
    settings = TrainSettings(steps=30, window=5, policies=SMALL)
    clean = train("BC_RNN", [first], [0], settings)[0]
    poisoned.actions[5:] = poisoned.actions[5:][::-1].copy()  # same mean and spread, other contents
    assert same(clean, train("BC_RNN", [poisoned], [0], settings)[0])


def test_windows_are_drawn_in_proportion_to_their_weights(robot: Robot) -> None:
    data = replace(
        one_path(robot, UP), window_starts=np.array([0, 2, 4]), window_weights=np.array([1.0, 0, 3])
    )
    norm = normaliser(data, "delta")
    kind = make_policy("BC_MLP", {"batch": 100})
    observations, _, _ = Batches(kind, [data], [norm], [0], "delta", 1, torch.device("cpu")).next()
    table = standardised(data, norm, "delta")[:, :9]
    drawn = (observations.reshape(-1, 1, 9) == table[data.window_starts]).all(-1).float().mean(0)
    assert drawn.tolist() == pytest.approx([0.25, 0, 0.75], abs=0.15)


@pytest.mark.parametrize("action", ["delta", "absolute"])
def test_standardisation_has_an_inverse_and_leaves_still_joints_still(robot: Robot, action: str) -> None:
    data = one_path(robot, UP)
    norm = normaliser(data, action)
    table = standardised(data, norm, action)
    observations = table[:, :9] * norm.observation_scale + norm.observation_mean
    np.testing.assert_allclose(observations, data.observations, atol=1e-6)
    actions = table[:, 9:] * norm.action_scale + norm.action_mean
    expected = data.actions if action == "delta" else data.actions + data.q
    np.testing.assert_allclose(actions, expected, atol=1e-6)
    assert table.abs().max() < 10
    still = 3
    assert not table[:, 9 + still].any()
    assert norm.action_scale[still] == pytest.approx(1e-3)


def test_cosine_schedule_falls_from_the_full_rate_to_nothing() -> None:
    settings = TrainSettings(steps=100, learning_rate=0.01)
    rates = [learning_rate(step, settings) for step in range(101)]
    assert rates[0] == 0.01
    assert rates[50] == pytest.approx(0.005)
    assert rates[100] == pytest.approx(0)
    assert learning_rate(99, TrainSettings(steps=100, learning_rate=0.01, schedule="constant")) == 0.01


def test_data_without_seed_and_data_of_another_robot_are_refused(robot: Robot) -> None:
    data = one_path(robot, UP)
    with pytest.raises(PlancurateError, match="2 data sets but 1 seeds"):
        train("BC_MLP", [data, data], [0], TrainSettings(steps=1))
    other = replace(data, actions=data.actions[:, :5])
    with pytest.raises(PlancurateError, match=r"data sets of \[5, 6\] joints"):
        train("BC_MLP", [data, other], [0, 0], TrainSettings(steps=1))
    with pytest.raises(PlancurateError, match="no demonstrations"):
        train("BC_MLP", [], [], TrainSettings(steps=1))


def test_settings_of_an_unknown_policy_or_field_are_refused_at_once() -> None:
    with pytest.raises(UnknownNameError, match="unknown policy 'BC_RN'"):
        TrainSettings(policies={"BC_RN": {}})
    with pytest.raises(UnknownNameError, match="unknown setting of BC_MLP 'hiden'"):
        TrainSettings(policies={"BC_MLP": {"hiden": [8]}})


def test_device_that_is_not_there_is_an_error_in_one_line(robot: Robot) -> None:
    with pytest.raises(PlancurateError, match="device: 'nowhere' can't be used"):
        train("BC_MLP", [one_path(robot, UP)], [0], TrainSettings(steps=1, device="nowhere"))


LINEAR = '''
"""A policy that is one linear map of what it sees."""
import torch
from torch import Tensor

from plancurate.tasks.learning.policies import Policy, register
from plancurate.tasks.learning.policies.layers import linear_weights


@register("Linear")
class LinearPolicy(Policy):
    """A single linear layer, mean squared error."""

    recurrent = False
    batch: int = 64

    def initial(self, observed: int, acted: int, rng: torch.Generator) -> dict[str, Tensor]:
        return linear_weights("only", observed, acted, rng)

    def loss(self, weights, observations, actions, masks):
        predicted = self.step(weights, observations.flatten(1, 2), None)[0]
        return (predicted - actions.flatten(1, 2)).square().mean((1, 2))

    def step(self, weights, observation, memory):
        return torch.baddbmm(weights["only.bias"], observation, weights["only.weight"]), None
'''


def test_a_policy_in_one_file_outside_the_package_is_trained_stored_and_rolled_out(
    robot: Robot, tmp_path: Path, install: Callable[[str, ModuleType], None]
) -> None:
    with pytest.raises(UnknownNameError, match="unknown policy 'Linear'"):
        TrainSettings().policy("Linear")
    install(LINEAR, policy_registry)
    assert "Linear" in policy_names()
    settings = TrainSettings(
        steps=400, weight_decay=0, learning_rate=0.01, policies={"Linear": {"batch": 32}}
    )
    trained = train("Linear", [one_path(robot, UP)], [0], settings)[0]
    assert trained.policy.batch == 32
    trained.save(tmp_path / "policy")
    goal = native.fk(robot.native, path_to(robot, UP)[-1:])[0, :3, 3]
    tests = unseen_tests([Target(0, goal, np.empty((0, 6)))])
    settings_ = EvaluateSettings(max_steps=60)
    trial = roll_out([load_policy(tmp_path / "policy")], robot, SCENE, tests, settings_, dt=0.1)[
        0
    ].to_pylist()[0]
    assert trial["success"]
    untrained = replace(trained, weights={n: 0 * value for n, value in trained.weights.items()})
    trial = roll_out([untrained], robot, SCENE, tests, EvaluateSettings(max_steps=3), dt=0.1)[0].to_pylist()[
        0
    ]
    assert not trial["success"]


def test_a_name_that_another_policy_has_is_refused() -> None:
    assert "BC_MLP" in policy_names()  # a look-up registers what the package has
    with pytest.raises(ValueError, match=r"policy 'BC_MLP' is registered by .*\.mlp already"):
        policy_registry.register("BC_MLP")(type("Other", (policy_registry.Policy,), {"__module__": __name__}))
