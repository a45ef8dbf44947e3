"""A policy with its world as MLflow serves it."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import torch

import plancurate.robots
from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.robots import load_world
from plancurate.tasks.candidates.targets import sample_targets
from plancurate.tasks.learning.policies import Normaliser, TrainedPolicy, make_policy
from plancurate.tasks.learning.policies.serving import ServedPolicy
from plancurate.tasks.learning.settings import EvaluateSettings
from plancurate.tasks.motion import served
from plancurate.tasks.motion.motion import Motion
from plancurate.tasks.motion.predict import PredictSettings
from plancurate.tasks.motion.served import ServedWorld, save_served
from plancurate.tasks.motion.verify import verify_motion

SETTINGS = PredictSettings(proposals=1, rollout=EvaluateSettings(max_steps=20))
LAYOUT = (("target_offset", 3), ("joint_positions", 6))


@pytest.fixture(scope="module", params=["BC_MLP", "BC_RNN"])
def policy_folder(request, tmp_path_factory):
    """A network that nobody trained: it goes nowhere, so the planner makes the motions."""
    policy = make_policy(request.param, {})
    same = Normaliser(torch.zeros(9), torch.ones(9), torch.zeros(6), torch.full((6,), 1e-3))
    weights = policy.initial(9, 6, torch.Generator().manual_seed(0))
    folder = tmp_path_factory.mktemp("policy") / "kept"
    TrainedPolicy(policy, weights, same, LAYOUT, "delta", window=10, seed=0).save(folder)
    return folder


@pytest.fixture
def own_files(tmp_path):
    """A robot and a scene of a user's own."""
    shipped = Path(plancurate.robots.__file__).parent
    robot = shutil.copytree(shipped / "h2017", tmp_path / "own" / "my_arm")
    scene = shutil.copy(shipped / "scenes" / "table.yaml", tmp_path / "own" / "my_table.yaml")
    return str(robot), str(scene)


def world_of(robot, scene):
    return ServedWorld(robot, scene, tuple(one.digest for one in load_world(robot, scene)), SETTINGS)


@pytest.mark.slow
def test_a_target_is_answered_with_a_motion_and_its_verdict_as_json(policy_folder, own_files, tmp_path):
    import mlflow.pyfunc
    from mlflow.pyfunc.scoring_server import invocations

    robot, scene = load_world("h2017", "table")
    save_served(tmp_path / "served", policy_folder, world_of(*own_files))
    shutil.rmtree(tmp_path / "own")  # the model holds what is no part of the package
    path = str(tmp_path / "model")
    mlflow.pyfunc.save_model(
        path,
        loader_module=served.__name__,
        data_path=str(tmp_path / "served"),
        pip_requirements=["plancurate"],
    )
    (target,) = sample_targets(robot, scene, SETTINGS.candidates.targets, 0, 1)
    targets = [target.position.tolist(), [5.0, 0.0, 0.0]]
    answered = invocations(
        json.dumps({"inputs": targets}), "application/json", mlflow.pyfunc.load_model(path), None
    )
    assert answered.status == 200, answered.response
    reached, out_of_reach = json.loads(answered.response)["predictions"]
    assert (reached["made_by"], reached["verdict"]["passed"]) == ("planner", True)
    assert reached["refused"][0].startswith("policy: came no nearer than")
    samples = reached["motion"]
    times, positions = np.array(samples["times"]), np.array(samples["positions"])
    assert verify_motion(robot, scene, Motion(times, positions, joint_names=robot.joint_names)).passed
    tool = native.fk(robot.native, positions[-1:])[0, :3, 3]
    assert np.linalg.norm(tool - targets[0]) < 1e-3
    assert (out_of_reach["made_by"], out_of_reach["motion"], out_of_reach["verdict"]) == (
        "nobody",
        None,
        None,
    )


def test_observations_are_answered_with_the_next_joint_angles(policy_folder, tmp_path):
    save_served(tmp_path / "served", policy_folder, world_of("h2017", "clutter:7"))
    model = served._load_pyfunc(str(tmp_path / "served"))
    rows = np.random.default_rng(0).normal(size=(4, 9))
    np.testing.assert_array_equal(model.predict(rows), ServedPolicy(model.trained).predict(rows))


def test_a_model_whose_world_changed_is_refused(policy_folder, own_files, tmp_path):
    folder = tmp_path / "served"
    save_served(folder, policy_folder, world_of(*own_files))
    assert json.loads((folder / "world.json").read_text())["scene"] == "world/my_table.yaml"
    scene = folder / "world" / "my_table.yaml"
    scene.write_text(scene.read_text().replace("margin: 0.005", "margin: 0.006"))
    with pytest.raises(PlancurateError, match=r"my_table\.yaml changed since the model was made"):
        served._load_pyfunc(str(folder))
