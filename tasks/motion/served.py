"""A policy with its world as an MLflow model: a target in, a motion and its verdict out; nothing is unpickled.

Rows of three numbers are targets, m; every observation is longer, and is answered with the next joint angles as
`ServedPolicy` does.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from plancurate.errors import PlancurateError
from plancurate.robots import Robot, Scene, load_world, robot_names, scene_names
from plancurate.tasks.learning.policies import TrainedPolicy, load_policy
from plancurate.tasks.learning.policies.serving import ServedPolicy
from plancurate.tasks.motion.predict import Prediction, PredictSettings, predict_motions

POLICY, WORLD, FILES = "policy", "world.json", "world"
POSITION = 3  # numbers in a target


@dataclass(frozen=True)
class ServedWorld:
    """Where a policy's motions are made, as another process loads it."""

    robot: str
    """A name or a folder."""
    scene: str
    """A name or a file."""
    digests: tuple[str, str]
    """Of robot and scene as they were: from others come other motions."""
    settings: PredictSettings


class ServedMotions:
    """Targets in, motions with their verdicts out."""

    def __init__(self, trained: TrainedPolicy, robot: Robot, scene: Scene, settings: PredictSettings) -> None:
        self.trained, self.robot, self.scene, self.settings = trained, robot, scene, settings
        self.steps = ServedPolicy(trained)

    def predict(self, model_input: Any, params: Mapping[str, Any] | None = None) -> Any:
        """An answer for each target (b, 3), m, as plain data; next joint angles (b, n) for observations.

        PlancurateError for input of another shape.
        """
        rows = np.array(model_input, dtype=np.float64)
        if rows.ndim != 2 or rows.shape[1] != POSITION:
            return self.steps.predict(rows)
        found = predict_motions(self.trained, self.robot, self.scene, rows, self.settings)
        return [answer(prediction) for prediction in found]


def answer(prediction: Prediction) -> dict[str, Any]:
    """A prediction as JSON has it, with its samples where there is a motion: times, s, and positions, rad (m)."""
    motion = prediction.motion
    samples = None
    if motion is not None:
        samples = {
            "joint_names": list(motion.joint_names or ()),
            "times": motion.times.tolist(),
            "positions": motion.positions.tolist(),
        }
    return prediction.as_record() | {"motion": samples}


def save_served(folder: Path, policy_folder: Path, world: ServedWorld) -> None:
    """Make the folder that MLflow stores: the policy, and its world with the files that are no part of the package."""
    shutil.copytree(policy_folder, folder / POLICY)
    record = {
        "robot": kept(folder, world.robot),
        "scene": kept(folder, world.scene),
        "digests": world.digests,
        "settings": world.settings.model_dump(mode="json"),
    }
    (folder / WORLD).write_text(json.dumps(record, indent=1))


def kept(folder: Path, source: str) -> str:
    """What a robot or scene is loaded by from the folder: its name, or the copy of a user's own files."""
    path = Path(source)
    if source in (*robot_names(), *scene_names()) or not path.exists():
        return source
    copy = folder / FILES / path.resolve().name
    copy.parent.mkdir(exist_ok=True)
    if path.is_dir():
        shutil.copytree(path, copy)
    else:
        shutil.copy(path, copy)
    return f"{FILES}/{copy.name}"


def _load_pyfunc(path: str) -> ServedMotions:
    """Load what `save_served` made; MLflow calls this. PlancurateError where robot or scene are others by now."""
    folder = Path(path)
    record = json.loads((folder / WORLD).read_text())
    sources = [
        str(folder / record[name]) if (folder / record[name]).exists() else record[name]
        for name in ("robot", "scene")
    ]
    robot, scene = load_world(*sources)
    if [robot.digest, scene.digest] != record["digests"]:
        raise PlancurateError(
            f"{folder}: robot {sources[0]} or scene {sources[1]} changed since the model was made"
        )
    settings = PredictSettings.model_validate(record["settings"])
    return ServedMotions(load_policy(folder / POLICY), robot, scene, settings)
