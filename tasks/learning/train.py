"""Train: many networks of one policy at once, each on its own demonstrations and from its own seed."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from typing import Any, Literal

import torch
from pydantic import BaseModel, ConfigDict, Field, model_validator

from plancurate.errors import PlancurateError
from plancurate.tasks.learning.demonstrations import Demonstrations
from plancurate.tasks.learning.policies.batches import Batches, generator, normaliser
from plancurate.tasks.learning.policies.device import usable
from plancurate.tasks.learning.policies.policy import Policy, kind_of, make_policy
from plancurate.tasks.learning.policies.stack import Adam, ParameterStack
from plancurate.tasks.learning.policies.trained import Action, TrainedPolicy

REVISION = 1
"""Raise it when training gives other networks than before: their ids hold it."""
LOG_ENTRIES = 50
"""Entries of a loss curve."""


class TrainSettings(BaseModel):
    """How every network is trained, whatever was selected for it."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    steps: int = Field(
        2000, ge=1, description="gradient steps, the same for every selection; the last state counts"
    )
    learning_rate: float = Field(1e-3, gt=0, description="largest step size of Adam")
    schedule: Literal["cosine", "constant"] = Field("cosine", description="how the learning rate goes on")
    weight_decay: float = Field(
        1.0,
        ge=0,
        description="pull of all weights to zero, so that a policy acts alike near what it was shown",
    )
    clip: float = Field(1.0, gt=0, description="largest norm of a network's gradient")
    window: int = Field(
        10,
        ge=1,
        description="steps a recurrent policy is trained on; in a rollout its memory is reset so often",
    )
    action: Action = Field(
        "delta", description="next joint angles as a difference to the present ones, or as they are"
    )
    size: Literal["small", "robomimic"] = Field(
        "small", description="small and fast networks, or the sizes of robomimic's experiments"
    )
    policies: dict[str, dict[str, Any]] = Field(
        default={}, description='settings of single policies, e.g. {"BC_RNN_Dropout": {"dropout": 0.3}}'
    )
    device: str = Field("cpu", description="where the networks are trained: cpu or cuda")

    @model_validator(mode="after")
    def _policies_are_known(self) -> TrainSettings:
        for name, values in self.policies.items():
            make_policy(name, values)
        return self

    def policy(self, name: str) -> Policy:
        """Build the named policy in the size and with the settings asked for."""
        sizes = kind_of(name).robomimic if self.size == "robomimic" else {}
        return make_policy(name, {**sizes, **self.policies.get(name, {})})


def train(
    policy: str,
    data: Sequence[Demonstrations],
    seeds: Sequence[int],
    settings: TrainSettings,
    progress: Callable[[int], None] | None = None,
) -> list[TrainedPolicy]:
    """Train one network of the named policy on each data set, from the seed beside it.

    A network's result depends on its data, seed and settings only, not on what else is trained with it.
    `progress` is told the gradient steps done. Raises PlancurateError for unknown names or mismatched data.
    """
    kind = settings.policy(policy)
    _check(data, seeds)
    device = usable(settings.device)
    began = time.perf_counter()
    normalisers = [normaliser(d, settings.action) for d in data]
    rngs = [generator(policy, seed, "weights") for seed in seeds]
    observed = data[0].observations.shape[1]
    networks = [kind.initial(observed, data[0].dof, rng) for rng in rngs]
    stack = ParameterStack(networks, device)
    batches = Batches(kind, data, normalisers, seeds, settings.action, settings.window, device)
    curve = descend(kind, stack, batches, settings, progress)
    with torch.no_grad():
        learnt = kind.diagnostics(stack.weights, batches.next()[0])
    share = (time.perf_counter() - began) / len(data)
    return [
        TrainedPolicy(
            policy=kind,
            weights=stack.network(s),
            normaliser=normalisers[s],
            action=settings.action,
            window=settings.window,
            seed=seed,
            train_s=share,
            loss_curve=[(step, losses[s]) for step, losses in curve],
            diagnostics={name: float(values[s]) for name, values in learnt.items()},
        )
        for s, seed in enumerate(seeds)
    ]


def descend(
    kind: Policy,
    stack: ParameterStack,
    batches: Batches,
    settings: TrainSettings,
    progress: Callable[[int], None] | None,
) -> list[tuple[int, list[float]]]:
    """Take all gradient steps; gives (steps done, mean loss of each network since the entry before)."""
    adam = Adam(stack, settings.clip, settings.weight_decay)
    every = math.ceil(settings.steps / LOG_ENTRIES)
    total, since = torch.zeros(len(stack.values), device=stack.values.device), 0
    curve: list[tuple[int, list[float]]] = []
    for step in range(settings.steps):
        observations, actions, masks = batches.next()
        losses = kind.loss(stack.weights, observations, actions, masks)
        adam.step(stack.gradients(losses), learning_rate(step, settings))
        total += losses.detach()
        since += 1
        if (step + 1) % every == 0 or step + 1 == settings.steps:
            curve.append((step + 1, (total / since).tolist()))
            total.zero_()
            since = 0
            if progress:
                progress(step + 1)
    return curve


def learning_rate(step: int, settings: TrainSettings) -> float:
    """Learning rate of a gradient step, from 0."""
    if settings.schedule == "constant":
        return settings.learning_rate
    return settings.learning_rate * 0.5 * (1 + math.cos(math.pi * step / settings.steps))


def _check(data: Sequence[Demonstrations], seeds: Sequence[int]) -> None:
    if not data:
        raise PlancurateError("train: no demonstrations were given")
    if len(data) != len(seeds):
        raise PlancurateError(
            f"train: {len(data)} data sets but {len(seeds)} seeds; give one seed a data set"
        )
    joints = {d.dof for d in data}
    if len(joints) > 1:
        raise PlancurateError(f"train: data sets of {sorted(joints)} joints; one stack is of one robot")
