"""Evaluate: roll trained policies out on test targets, all networks and all tests at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import torch
from pydantic import BaseModel, ConfigDict, Field

from plancurate import native
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.tasks.learning.policies.acting import ActingStack
from plancurate.tasks.learning.policies.trained import TrainedPolicy
from plancurate.tasks.learning.test_targets import TargetsUnderTest

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

REVISION = 1
"""Raise it when test targets or rollouts come out otherwise than before: the ids of evaluations hold it."""


class EvaluateSettings(BaseModel):
    """How a rollout is run and judged."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    max_steps: int = Field(200, ge=1, description="steps after which a rollout ends")
    reach_m: float = Field(0.05, gt=0, description="a target is reached when the tool is nearer than this, m")
    resolution: float = Field(
        0.05, gt=0, description="largest joint step between collision checks of a move, rad"
    )
    seed: int = Field(1000, description="seed of the displaced test targets")
    device: str = Field("cpu", description="where the networks run: cpu or cuda")


class Trials:
    """What has happened so far in b rollouts.

    A trial is scored until its tool reaches the target, a move breaks a rule (then the robot stays where it
    was and the trial has failed) or the steps run out; its distances and lengths are those of that moment. A
    trial that has reached its target moves on unscored, to show whether it settles there.
    """

    def __init__(self, robot: Robot, scene: Scene, targets: FloatArray, settings: EvaluateSettings) -> None:
        b = len(targets)
        self.robot, self.scene, self.targets, self.settings = robot, scene, targets, settings
        self.q = np.tile(robot.home, (b, 1))
        self.tool = native.fk(robot.native, self.q)[:, :3, 3]
        self.reached = self.distance() < settings.reach_m
        self.collided, self.out_of_limits, self.stopped = (np.zeros(b, dtype=bool) for _ in range(3))
        self.steps = np.zeros(b, dtype=np.int32)
        self.final_distance = self.distance()
        self.path_length, self.joint_movement = np.zeros(b), np.zeros(b)

    def distance(self) -> FloatArray:
        """Distances (b,) of the tool from the target now, m."""
        return np.asarray(np.linalg.norm(self.targets - self.tool, axis=1))

    def observations(self) -> FloatArray:
        """Observations (b, 3 + n)."""
        return np.concatenate([self.targets - self.tool, self.q], axis=1)

    def move(self, q: FloatArray) -> None:
        """Go to joint angles q (b, n), as far as each trial may."""
        scored = ~(self.reached | self.stopped)
        with np.errstate(invalid="ignore"):
            inside = ((q >= self.robot.lower) & (q <= self.robot.upper)).all(axis=1)
        q = np.where((inside & ~self.stopped)[:, None], q, self.q)
        free = native.edge_is_free(self.robot.native, self.scene.native, self.q, q, self.settings.resolution)
        self.out_of_limits |= scored & ~inside
        self.collided |= scored & ~free
        self.stopped |= ~(inside & free)
        self._arrive(np.where(free[:, None], q, self.q), scored & ~self.stopped)

    def _arrive(self, q: FloatArray, scored: BoolArray) -> None:
        tool = native.fk(self.robot.native, q)[:, :3, 3]
        self.path_length += scored * np.linalg.norm(tool - self.tool, axis=1)
        self.joint_movement += scored * np.abs(q - self.q).sum(axis=1)
        self.q, self.tool = q, tool
        self.steps += scored
        self.final_distance = np.where(scored, self.distance(), self.final_distance)
        self.reached |= scored & (self.final_distance < self.settings.reach_m)

    def columns(self) -> dict[str, npt.NDArray[np.generic]]:
        """One value a trial for each measured column."""
        near = self.distance() < self.settings.reach_m
        return {
            "success": self.reached,
            "reached": self.reached,
            "settled": near & ~self.stopped,
            "collided": self.collided,
            "out_of_limits": self.out_of_limits,
            "steps": self.steps,
            "final_distance": self.final_distance,
            "settled_distance": self.distance(),
            "path_length": self.path_length,
            "joint_movement": self.joint_movement,
        }


def roll_out(
    policies: Sequence[TrainedPolicy],
    robot: Robot,
    scene: Scene,
    tests: TargetsUnderTest,
    settings: EvaluateSettings,
) -> list[pa.Table]:
    """Roll every policy out on every test from the robot's home; gives a table of trials for each policy.

    All policies are of one kind and of the same sizes, as `train` returns them. The policy's next joint
    angles become the next state. Columns: test_id, kind, target_id, distance_cm, x, y, z of the test;
    success (reached with every move up to then inside the limits and free), reached (the same, since a rule
    broken before ends the trial), collided and out_of_limits (which rule ended it), settled (still within
    reach at the step limit, with no rule broken on the way); steps, final_distance, path_length and
    joint_movement when the scored part ended; settled_distance at the step limit.
    """
    stack = ActingStack(policies, settings.device)
    trials = Trials(robot, scene, np.tile(tests.position, (len(policies), 1)), settings)
    shape = (len(policies), len(tests), -1)
    for _ in range(settings.max_steps):
        observations = torch.from_numpy(trials.observations()).view(shape)
        trials.move(stack.next_q(observations).flatten(0, 1).numpy())
    columns = {name: value.reshape(shape[:2]) for name, value in trials.columns().items()}
    return [
        trial_table(tests, {name: value[s] for name, value in columns.items()}) for s in range(len(policies))
    ]


def trial_table(tests: TargetsUnderTest, measured: dict[str, npt.NDArray[np.generic]]) -> pa.Table:
    """Trials of one policy: the tests' columns and the measured ones."""
    x, y, z = tests.position.T
    tested = {
        "test_id": np.arange(len(tests), dtype=np.int32),
        "kind": tests.kind,
        "target_id": tests.target_id,
        "distance_cm": pa.array(tests.distance_cm, mask=tests.distance_cm < 0),
        "x": x,
        "y": y,
        "z": z,
    }
    return pa.table(tested | measured)
