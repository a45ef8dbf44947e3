"""What hard_scenes.py compares corrections with: two ways to keep a policy off obstacles without rolling it out.

Labels of states near the demonstrations: the states are drawn with noise, a label leads back to the demonstration a
little farther on, and is pushed out of collision until it keeps a clearance. And a hinge on clearance in the loss: what
the state that an action leads to lacks of a clearance is a cost. Clearance is the kernel's distance of the arm from
obstacles and floor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from pydantic import PrivateAttr
from torch import Tensor

from plancurate import native
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.learning.demonstrations import Demonstrations, limited_share
from plancurate.tasks.learning.join import join_demonstrations
from plancurate.tasks.learning.observations import observe, state_at
from plancurate.tasks.learning.policies import Normaliser, TrainedPolicy
from plancurate.tasks.learning.policies.batches import Batches, generator, normaliser
from plancurate.tasks.learning.policies.mlp import MLPPolicy
from plancurate.tasks.learning.policies.policy import Weights
from plancurate.tasks.learning.policies.stack import ParameterStack
from plancurate.tasks.learning.settings import TrainSettings
from plancurate.tasks.learning.train import descend, train
from plancurate.tasks.study.context import PoolContext, StudyContext
from plancurate.tasks.study.demonstrations import positions, selected_demonstrations
from plancurate.tasks.study.selections import WantedSelection, make_selection

POLICY = MLPPolicy.name
CLEARANCE_M = 0.03  # what the demonstrations were planned with
NOISE_RAD = 0.05  # deviation of each joint of a state near a demonstration
AHEAD = 4  # steps along the demonstration to where a label leads
MOST_SHARE = 0.2  # of what a network learns from, in the mean over batches, that is such states
WEIGHT = 5.0  # of the hinge, 1/m, beside the mean squared error of standardised actions
SHIFT_RAD = 0.01  # of one joint to either side, for the slope of the distance
PUSHES, LONGEST_PUSH_RAD = 20, 0.05
SLACK_M = 1e-3  # that a pushed label may lack


def lacking(robot: Robot, scene: Scene, q: FloatArray, clearance: float) -> tuple[FloatArray, FloatArray]:
    """What joint angles q (b, n) lack of a clearance, m: max(0, clearance - distance) (b,), and its slope by q (b, n).

    A state that touches lacks all of the clearance, and has a slope only where a small shift of a joint frees it.
    """
    lack = np.maximum(0, clearance - _distance(robot, scene, q))
    slope = np.zeros_like(q)
    near = np.flatnonzero(lack)
    shifts = SHIFT_RAD * np.concatenate([np.eye(robot.dof), -np.eye(robot.dof)])
    shifted = (q[near, None] + shifts).reshape(-1, robot.dof)
    sides = _distance(robot, scene, shifted).reshape(len(near), 2, robot.dof)
    slope[near] = (sides[:, 1] - sides[:, 0]) / (2 * SHIFT_RAD)
    return lack, slope


def _distance(robot: Robot, scene: Scene, q: FloatArray) -> FloatArray:
    """Distances (b,) of the arm from obstacles and floor, m; 0 where they touch, for the kernel knows no depth."""
    return np.maximum(0, native.clearance(robot.native_without_pairs, scene.native, q))


def pushed(robot: Robot, scene: Scene, q: FloatArray, clearance: float) -> FloatArray:
    """Joint angles q (b, n) moved as little as it takes to keep a clearance, m, where a few steps down its lack do."""
    q = q.copy()
    for _ in range(PUSHES):
        lack, slope = lacking(robot, scene, q, clearance)
        steep = (slope**2).sum(axis=1, keepdims=True)
        step = np.divide(lack[:, None] * slope, steep, out=np.zeros_like(q), where=steep > 0)
        length = np.linalg.norm(step, axis=1, keepdims=True)
        q -= step * np.minimum(1, LONGEST_PUSH_RAD / np.maximum(length, LONGEST_PUSH_RAD))
    return q


def trained_nearby(
    study: StudyContext, pool: PoolContext, wanted: WantedSelection, *, push: bool
) -> list[TrainedPolicy]:
    """Train on a selection and on states near its demonstrations, from each seed of the study."""
    settings, data = study.config.training, selected_demonstrations(study, wanted)
    targets = positions(study, pool, make_selection(study, wanted).kept["target_id"].to_pylist())
    more = nearby(pool.robot, pool.scene, data, targets, settings, push=push)
    joined = limited_share(join_demonstrations([data, more]), len(data.starts), MOST_SHARE)
    return train(POLICY, [joined] * len(study.config.seeds), study.config.seeds, settings)


def trained_hinged(study: StudyContext, pool: PoolContext, wanted: WantedSelection) -> list[TrainedPolicy]:
    """Train on a selection with the hinge, from each seed of the study."""
    data = selected_demonstrations(study, wanted)
    return train_with_hinge(pool.robot, pool.scene, data, study.config.seeds, study.config.training, WEIGHT)


def nearby(
    robot: Robot,
    scene: Scene,
    data: Demonstrations,
    targets: FloatArray,
    settings: TrainSettings,
    *,
    push: bool,
) -> Demonstrations:
    """A state near each step of demonstrations to targets (episodes, 3), m, with its label, unless the state collides.

    A label is an arc step toward the state that is AHEAD steps on. `push` says whether it is pushed out of collision;
    one that can't be is then left out.
    """
    last = np.repeat(data.starts + data.lengths - 1, data.lengths)
    q = data.q + np.random.default_rng(0).normal(0, NOISE_RAD, data.q.shape)
    way = data.q[np.minimum(np.arange(len(q)) + AHEAD, last)] - q
    asked = q + way * np.minimum(1, settings.arc_rad / np.linalg.norm(way, axis=1, keepdims=True))
    used = native.is_free(robot.native, scene.native, q)
    if push:
        asked = pushed(robot, scene, asked, CLEARANCE_M)
        used &= lacking(robot, scene, asked, CLEARANCE_M)[0] < SLACK_M
    q, asked, goals = q[used], asked[used], data.q[last[used]].astype(np.float64)
    state = state_at(
        robot, scene, q, np.repeat(targets, data.lengths, axis=0)[used], previous_q=q, goal=goals
    )
    return Demonstrations(
        layout=data.layout,
        observations=observe(settings.observation, state).astype(np.float32),
        q=q.astype(np.float32),
        actions=(asked - q).astype(np.float32),
        starts=np.arange(len(q)),
        lengths=np.ones(len(q), np.int64),
    )


@dataclass(frozen=True, eq=False)
class Hinge:
    """What the states that networks lead to lack of a clearance, in the mean, times a weight."""

    robot: Robot
    scene: Scene
    norm: Normaliser
    joints: slice
    """Where an observation holds the joint angles."""
    weight: float

    def __call__(self, observed: Tensor, acted: Tensor) -> Tensor:
        """For each network (S,), of standardised observations (S, batch, o) and predicted actions (S, batch, n)."""
        norm, joints = self.norm, self.joints
        q = observed[..., joints] * norm.observation_scale[joints] + norm.observation_mean[joints]
        after = q + acted * norm.action_scale + norm.action_mean
        asked = after.detach().double().flatten(0, -2).numpy()
        lack, slope = (
            torch.from_numpy(x).float() for x in lacking(self.robot, self.scene, asked, CLEARANCE_M)
        )
        # The kernel knows no gradients: a plane of the same height and slope stands for what is lacking.
        height = (slope.view_as(after) * (after - after.detach())).sum(-1) + lack.view(after.shape[:-1])
        return self.weight * height.mean(-1)


class HingedMLP(MLPPolicy):
    """BC_MLP with a hinge in its loss."""

    _hinge: Hinge = PrivateAttr()

    def __init__(self, hinge: Hinge, **settings: Any) -> None:
        """Take the settings of BC_MLP."""
        super().__init__(**settings)
        self._hinge = hinge

    def loss(self, weights: Weights, observations: Tensor, actions: Tensor, masks: Tensor | None) -> Tensor:
        """Mean squared error and hinge of each network."""
        observed = observations.flatten(1, 2)
        imitation = super().loss(weights, observations, actions, masks)
        return imitation + self._hinge(observed, self._act(weights, observed))


def train_with_hinge(
    robot: Robot,
    scene: Scene,
    data: Demonstrations,
    seeds: Sequence[int],
    settings: TrainSettings,
    weight: float,
) -> list[TrainedPolicy]:
    """A network for each seed: what `train` gives, but for the hinge."""
    kind, norm = settings.policy(POLICY), normaliser(data, settings.action)
    hinge = Hinge(robot, scene, norm, joints_observed(data), weight)
    hinged = HingedMLP(hinge, **kind.model_dump())
    device, networks = torch.device("cpu"), len(seeds)
    rngs = [generator(POLICY, seed, "weights") for seed in seeds]
    stack = ParameterStack([kind.initial(data.observations.shape[1], data.dof, rng) for rng in rngs], device)
    batches = Batches(
        hinged, [data] * networks, [norm] * networks, seeds, settings.action, settings.window, device
    )
    descend(hinged, stack, batches, settings, None)
    return [
        TrainedPolicy(
            kind, stack.network(s), norm, data.layout, settings.action, settings.window, seed, goals=data.goals
        )
        for s, seed in enumerate(seeds)
    ]  # fmt: skip


def joints_observed(data: Demonstrations) -> slice:
    """Where an observation holds the joint angles."""
    names, sizes = zip(*data.layout, strict=True)
    first = sum(sizes[: names.index("joint_positions")])
    return slice(first, first + data.dof)
