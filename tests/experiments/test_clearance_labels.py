"""The mathematics of what corrections are compared with: labels pushed to a clearance, and a hinge on clearance."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import torch

from plancurate import native
from plancurate.robots import Robot, Scene, load_robot, load_scene
from plancurate.tasks.learning.demonstrations import Demonstrations, demonstrations
from plancurate.tasks.learning.policies import TrainedPolicy
from plancurate.tasks.learning.policies.batches import normaliser
from plancurate.tasks.learning.settings import TrainSettings
from plancurate.tasks.learning.train import train

EXPERIMENTS = Path(__file__).parents[2] / "experiments"
CLEARANCE = 0.03
TERMS = ("target_offset", "joint_positions", "goal_offset")
SETTINGS = TrainSettings(
    steps=20,
    observation=TERMS,
    demonstration_steps="arc",
    policies={"BC_MLP": {"hidden": (16,), "batch": 16}},
)


@pytest.fixture
def labels(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The experiment's module."""
    monkeypatch.syspath_prepend(EXPERIMENTS)
    import clearance_labels as module  # type: ignore[import-not-found]

    return module


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("h2017")


@pytest.fixture(scope="module")
def table(robot: Robot) -> Scene:
    return load_scene("table", robot)


def distances(robot: Robot, scene: Scene, q: np.ndarray) -> np.ndarray:
    return native.clearance(robot.native_without_pairs, scene.native, q)


def off(data: Demonstrations, q: np.ndarray) -> float:
    """Mean distance of states q (b, 6) from the nearest state of the demonstrations, rad."""
    return float(np.linalg.norm(q[:, None] - data.q, axis=2).min(axis=1).mean())


def near_the_table(robot: Robot, scene: Scene) -> np.ndarray:
    """States (b, 6) that touch nothing, some of which lack clearance."""
    q = robot.home + np.random.default_rng(0).uniform(-0.1, 0.1, (1000, robot.dof))
    return q[distances(robot, scene, q) > 0.002]


@pytest.fixture(scope="module")
def data(robot: Robot, table: Scene) -> Demonstrations:
    """Two demonstrations: one turns the tool close to an obstacle, one moves away."""
    share = np.linspace(0, 1, 10)[:, None]
    ways = share * np.array([0, 0.03, 0, 0, 0, 1.5]), share * np.full(robot.dof, -0.4)
    paths = [robot.home + way for way in ways]
    targets = native.fk(robot.native, np.stack([path[-1] for path in paths]))[:, :3, 3]
    return demonstrations(robot, table, paths, targets, SETTINGS)


def lack(
    labels: ModuleType, robot: Robot, scene: Scene, data: Demonstrations, policy: TrainedPolicy
) -> float:
    """What the states that a policy leads to from the demonstrations' lack of the clearance in the mean, m."""
    norm = policy.normaliser
    observed = (torch.from_numpy(data.observations) - norm.observation_mean) / norm.observation_scale
    weights = {name: value[None] for name, value in policy.weights.items()}
    acted, _ = policy.policy.step(weights, observed[None], None)
    return float(labels.Hinge(robot, scene, norm, labels.joints_observed(data), 1.0)(observed[None], acted))


def test_a_push_gives_a_state_its_clearance_and_leaves_alone_what_has_it(
    labels: ModuleType, robot: Robot, table: Scene
) -> None:
    q = near_the_table(robot, table)
    near = distances(robot, table, q) < CLEARANCE
    assert 50 < near.sum() < len(q) - 50
    pushed = labels.pushed(robot, table, q, CLEARANCE)
    assert distances(robot, table, pushed[near]).min() > CLEARANCE - labels.SLACK_M
    assert np.linalg.norm(pushed - q, axis=1).max() < 0.1
    assert np.array_equal(pushed[~near], q[~near])


def test_a_push_frees_a_state_that_touches_lightly(labels: ModuleType, robot: Robot, table: Scene) -> None:
    down = robot.home + np.linspace(0, 1, 200)[:, None] * np.array([0, 0.2, 0, 0, 0, 0])
    touching = down[distances(robot, table, down) <= 0][:1]
    pushed = labels.pushed(robot, table, touching, CLEARANCE)
    assert distances(robot, table, pushed)[0] > CLEARANCE - labels.SLACK_M


def test_states_near_demonstrations_are_free_and_led_back_to_them_with_clearance(
    labels: ModuleType, robot: Robot, table: Scene, data: Demonstrations
) -> None:
    targets = native.fk(robot.native, data.q[data.starts + data.lengths - 1].astype(float))[:, :3, 3]
    pushed = labels.nearby(robot, table, data, targets, SETTINGS, push=True)
    as_drawn = labels.nearby(robot, table, data, targets, SETTINGS, push=False)
    for more, least in ((pushed, CLEARANCE - 2e-3), (as_drawn, -1)):
        q = more.q.astype(float)
        assert 0.4 * len(data.q) < len(q) <= len(data.q)
        assert native.is_free(robot.native, table.native, q).all()
        assert distances(robot, table, q + more.actions).min() > least
    assert distances(robot, table, as_drawn.q.astype(float) + as_drawn.actions).min() < CLEARANCE - 5e-3
    assert off(data, as_drawn.q + as_drawn.actions) < 0.8 * off(data, as_drawn.q)
    ends = as_drawn.q + as_drawn.observations[:, 9:]
    tool = native.fk(robot.native, as_drawn.q.astype(float))[:, :3, 3]
    for seen, wanted in ((tool + as_drawn.observations[:, :3], targets), (ends, data.goals.configurations)):
        apart = np.linalg.norm(seen[:, None] - wanted, axis=2)
        assert apart.min(axis=1).max() < 1e-5
        assert set(apart.argmin(axis=1)) == {0, 1}


def test_the_gradient_of_the_hinge_is_that_of_finite_differences(
    labels: ModuleType, robot: Robot, table: Scene, data: Demonstrations
) -> None:
    q = near_the_table(robot, table)
    q = q[distances(robot, table, q) < CLEARANCE - 0.002][:64]
    norm, joints, shift = normaliser(data, "delta"), slice(3, 9), 0.05
    hinge = labels.Hinge(robot, table, norm, labels.joints_observed(data), 5.0)
    observed = torch.zeros(1, len(q), 15)
    mean, scale = norm.observation_mean[joints], norm.observation_scale[joints]
    observed[0, :, joints] = (torch.from_numpy(q).float() - mean) / scale
    still = -norm.action_mean / norm.action_scale
    acted = still.expand(1, len(q), 6).clone().requires_grad_()
    cost = hinge(observed, acted)
    assert cost.item() == pytest.approx(5 * (CLEARANCE - distances(robot, table, q)).mean(), rel=1e-3)
    (gradient,) = torch.autograd.grad(cost.sum(), acted)
    for joint in range(6):
        step = shift * torch.eye(6)[joint]
        measured = (hinge(observed, acted + step) - hinge(observed, acted - step)).item() / (2 * shift)
        assert gradient[0, :, joint].sum().item() == pytest.approx(measured, rel=0.05, abs=1e-5)
    assert gradient.abs().max() > 0


def test_without_weight_the_hinge_changes_nothing_and_with_it_predictions_keep_off(
    labels: ModuleType, robot: Robot, table: Scene, data: Demonstrations
) -> None:
    (plain,) = train("BC_MLP", [data], [3], SETTINGS)
    (weightless,) = labels.train_with_hinge(robot, table, data, [3], SETTINGS, 0.0)
    assert all(torch.equal(value, weightless.weights[name]) for name, value in plain.weights.items())
    (kept_off,) = labels.train_with_hinge(robot, table, data, [3], SETTINGS, 1000.0)
    assert lack(labels, robot, table, data, kept_off) < 0.8 * lack(labels, robot, table, data, plain)
