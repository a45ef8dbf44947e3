from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest
import torch

from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.tasks.candidates.payload import Payload
from plancurate.tasks.candidates.settings import GenerateSettings, PlanSettings
from plancurate.tasks.candidates.targets import sample_targets
from plancurate.tasks.learning.policies import Normaliser, TrainedPolicy
from plancurate.tasks.learning.policies.policy import Policy
from plancurate.tasks.learning.training_goals import TrainingGoals
from plancurate.tasks.motion.predict import STAGES, PredictSettings, predict_motions
from plancurate.tasks.motion.rollout import policy_path
from plancurate.tasks.motion.verify import verify_motion

from .motions import world

STEP = 0.06  # rad that a joint moves at most


class Straight(Policy):
    """Goes straight to the goal configuration that it observes, or away from it, or not at all."""

    name: ClassVar[str] = "Straight"
    recurrent: ClassVar[bool] = False
    batch: int = 1
    ways: tuple[float, ...] = (1.0,)

    def initial(self, observed, acted, rng):
        return {"none": torch.zeros(1)}

    def loss(self, weights, observations, actions, masks):
        raise AssertionError("nobody trains it")

    def step(self, weights, observation, memory):
        longest = observation.abs().amax(-1, keepdim=True).clamp(min=STEP)
        return self.ways[0] * observation * STEP / longest, None

    def proposals(self, count):
        return [self.model_copy(update={"ways": (way,)}) for way in self.ways[:count]]


def straight(targets, *ways):
    goals = TrainingGoals(
        np.array([target.position for target in targets]), np.array([nearest(target) for target in targets])
    )
    same = Normaliser(torch.zeros(6), torch.ones(6), torch.zeros(6), torch.ones(6))
    policy = Straight(ways=ways or (1.0,))
    weights = {"none": torch.zeros(1)}
    return TrainedPolicy(policy, weights, same, (("goal_offset", 6),), "delta", window=1, seed=0, goals=goals)


def nearest(target):
    robot, _ = world("free")
    return target.goals[np.linalg.norm(target.goals - robot.home, axis=1).argmin()]


def drawn(scene, count=4):
    return sample_targets(*world(scene), GenerateSettings().targets, 0, count)


def positions(targets):
    return np.array([target.position for target in targets])


def assert_it_leads_there(prediction, scene):
    robot, loaded = world(scene)
    assert verify_motion(robot, loaded, prediction.motion).passed
    assert prediction.verdict.passed
    np.testing.assert_allclose(prediction.motion.positions[0], robot.home, atol=1e-6)
    tool = native.fk(robot.native, prediction.motion.positions[-1:])[0, :3, 3]
    assert np.linalg.norm(tool - prediction.target) == pytest.approx(prediction.distance_m)
    assert prediction.distance_m < PredictSettings().rollout.reach_m


def test_a_policy_that_gets_there_makes_every_motion():
    targets = drawn("free")
    found = predict_motions(straight(targets), *world("free"), positions(targets))
    for prediction in found:
        assert prediction.made_by == "policy"
        assert_it_leads_there(prediction, "free")
        assert prediction.refused == []
        assert tuple(prediction.seconds) == STAGES
        assert min(prediction.seconds[stage] for stage in ("rollout", "timing", "verification")) > 0
        assert prediction.seconds["planning"] == 0


@pytest.mark.slow
@pytest.mark.parametrize("way", [0.0, -1.0])
def test_the_planner_goes_where_the_policy_does_not_get_to(way):
    targets = drawn("table", 3)
    found = predict_motions(straight(targets, way), *world("table"), positions(targets))
    for prediction in found:
        assert prediction.made_by == "planner"
        assert_it_leads_there(prediction, "table")
        assert prediction.distance_m < 1e-3
        assert prediction.refused[0].startswith("policy: came no nearer than")
        assert prediction.seconds["planning"] > 0


@pytest.mark.slow
def test_a_rollout_that_does_not_pass_the_verifier_is_not_returned():
    targets = drawn("free", 2)
    policy = straight(targets)
    heavy = Payload(mass_kg=60, centre_m=(0, 0, 0.2))
    for prediction in predict_motions(policy, *world("free"), positions(targets), payload=heavy):
        assert (prediction.made_by, prediction.motion, prediction.verdict) == ("nobody", None, None)
        assert prediction.refused[0].startswith("policy: joint_")
        assert prediction.refused[1].startswith("planner: joint_")
        assert "torque limit" in prediction.refused[0]


@pytest.mark.slow
def test_of_several_proposals_the_first_that_passes_is_taken():
    targets = drawn("free", 2)
    at = positions(targets)
    found = predict_motions(straight(targets, 0.0, -1.0, 1.0), *world("free"), at)
    alone = predict_motions(straight(targets, 1.0), *world("free"), at)
    for prediction, other in zip(found, alone, strict=True):
        assert prediction.made_by == "policy"
        assert len(prediction.refused) == 2
        np.testing.assert_array_equal(prediction.motion.positions, other.motion.positions)
    fewer = PredictSettings(proposals=2)
    found = predict_motions(straight(targets, 0.0, -1.0, 1.0), *world("free"), at, fewer)
    assert {prediction.made_by for prediction in found} == {"planner"}


def test_without_a_policy_the_planner_makes_all_and_again_the_same():
    at = positions(drawn("table", 2))
    found = [predict_motions(None, *world("table"), at) for _ in range(2)]
    for one, other in zip(*found, strict=True):
        assert one.made_by == "planner"
        np.testing.assert_array_equal(one.motion.positions, other.motion.positions)


def test_a_target_that_nobody_reaches_is_said_to_be_one():
    targets = drawn("free", 1)
    far = np.array([[9.0, 0.0, 0.0]])
    settings = PredictSettings(candidates=GenerateSettings(plan=PlanSettings(runs=1)))
    (prediction,) = predict_motions(straight(targets), *world("free"), far, settings)
    assert prediction.made_by == "nobody"
    assert prediction.refused[-1].startswith("planner: no free joint position")
    assert prediction.as_record()["duration_s"] is None


def test_a_target_too_near_an_obstacle_for_the_planner_s_clearance_is_reached_without_it():
    targets = drawn("table", 1)
    settings = PredictSettings(candidates=GenerateSettings(plan=PlanSettings(runs=1, clearance_m=0.5)))
    (prediction,) = predict_motions(None, *world("table"), positions(targets), settings)
    assert prediction.made_by == "planner"
    assert len(prediction.refused) == 1
    assert "clearance" in prediction.refused[0]


@pytest.mark.parametrize("targets", [np.zeros((2, 2)), np.zeros(3), np.full((1, 3), np.nan)])
def test_targets_that_are_none_are_refused(targets):
    with pytest.raises(PlancurateError, match="rows of x, y and z"):
        predict_motions(None, *world("free"), targets)


def test_where_the_policy_came_nearest_is_where_its_path_ends():
    states = np.arange(5.0)[:, None] * np.ones(6)
    found = policy_path(None, 0, states, np.array([0.5, 0.2, 0.01, 0.03, 0.01]), reach_m=0.05)
    np.testing.assert_array_equal(found.path, states[:3])
    assert (found.distance_m, found.reason) == (0.01, "")
