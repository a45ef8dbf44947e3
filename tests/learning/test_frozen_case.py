"""Tiny trainings and rollouts whose numbers are pinned together with the revisions of what makes them."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from plancurate.robots import load_robot, load_scene
from plancurate.tasks.learning import rollouts, train
from plancurate.tasks.learning.demonstrations import Demonstrations, demonstrations
from plancurate.tasks.learning.policies import Normaliser, TrainedPolicy, kind_of, policy_names
from plancurate.tasks.learning.settings import EvaluateSettings, TrainSettings
from plancurate.tasks.learning.test_targets import TargetsUnderTest

ROBOT, SCENE = load_robot("h2017"), load_scene("table")
SETTINGS = TrainSettings(steps=40, weight_decay=1.0, policies={"BC_MLP": {"hidden": [128, 128]}})
# By policy, its revision and that of training: loss at the end, and sum of all weights.
TRAINED = {
    ("BC_MLP", 1, 1): (0.194805, 3.15276),
    ("BC_RNN", 1, 1): (0.488786, 4.66387),
    ("BC_RNN_Dropout", 2, 1): (0.509154, 3.22396),
    ("BC_RNN_MDN", 1, 1): (6.50513, 10.1139),
}
# By revision of rollouts: steps, and distances from the target at the end in mm.
ROLLED = {2: ([19, 19, 19], [302.71, 479.54, 210.1])}
ADVICE = "{what} gives other numbers than before: raise its revision, and pin the new numbers here"


@pytest.fixture(scope="module")
def data() -> Demonstrations:
    """Three straight motions from home."""
    ends = ROBOT.home + np.array([[0.4, 0.1, -0.2, 0.1, 0.0, 0.3], [-0.3, 0.2, 0.1, 0, 0.2, 0], [0.1] * 6])
    paths = [np.linspace(ROBOT.home, end, 15) for end in ends]
    positions = np.array([[0.5, 0.1, 0.9], [0.4, -0.3, 1.0], [0.6, 0.0, 0.8]])
    return demonstrations(ROBOT, SCENE, paths, positions, SETTINGS)


@pytest.mark.parametrize("name", policy_names())
def test_training_changes_with_its_revisions_alone(data: Demonstrations, name: str) -> None:
    trained = train.train(name, [data], [0], SETTINGS)[0]
    total = sum(float(weight.double().sum()) for weight in trained.weights.values())
    pinned = TRAINED[name, kind_of(name).revision, train.REVISION]
    assert (trained.loss_curve[-1][1], total) == pytest.approx(pinned, rel=1e-3), ADVICE.format(what=name)


def steady(delta: list[float]) -> TrainedPolicy:
    """A policy that always moves by the same difference."""
    kind = kind_of("BC_MLP")(hidden=(2,))
    layout = (("target_offset", 3), ("joint_positions", 6))
    weights = {name: value * 0 for name, value in kind.initial(9, 6, torch.Generator()).items()}
    weights["layer_1.bias"] = torch.tensor([delta])
    normaliser = Normaliser(torch.zeros(9), torch.ones(9), torch.zeros(6), torch.ones(6))
    return TrainedPolicy(kind, weights, normaliser, layout, "delta", 10, 0)


def test_rollouts_change_with_their_revision_alone() -> None:
    positions = np.array([[0.5, 0.1, 0.9], [0.3, 0.4, 1.0], [0.7, 0.2, 0.5]])
    kinds, ids = ("unseen",) * 3, np.arange(3, dtype=np.int32)
    tests = TargetsUnderTest(kinds, ids, np.full(3, -1, dtype=np.int32), positions, ids)
    policy = steady([0.02, 0.01, 0.02, 0.0, 0.01, 0.0])
    trials = rollouts.roll_out([policy], ROBOT, SCENE, tests, EvaluateSettings(max_steps=60), dt=0.05)[0]
    distances = [1000 * value for value in trials["settled_distance"].to_pylist()]
    steps, pinned = ROLLED[rollouts.REVISION]
    advice = ADVICE.format(what="A rollout")
    assert trials["steps"].to_pylist() == steps, advice
    assert distances == pytest.approx(pinned, abs=0.01), advice
