"""Train: many networks of one policy at once, each on its own demonstrations and from its own seed."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence

import torch

from plancurate.errors import PlancurateError
from plancurate.tasks.learning.demonstrations import Demonstrations
from plancurate.tasks.learning.policies.batches import Batches, generator, normaliser
from plancurate.tasks.learning.policies.device import usable
from plancurate.tasks.learning.policies.policy import Policy
from plancurate.tasks.learning.policies.stack import ParameterStack, clip
from plancurate.tasks.learning.policies.trained import TrainedPolicy
from plancurate.tasks.learning.settings import TrainSettings

REVISION = 1
"""Raise it when training gives other networks than before: their ids hold it."""
LOG_ENTRIES = 50
"""Entries of a loss curve."""


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
    _check(data, seeds, settings)
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
            layout=data[s].layout,
            goals=data[s].goals,
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
    adam = torch.optim.AdamW([stack.values], weight_decay=settings.weight_decay, foreach=False)
    every = math.ceil(settings.steps / LOG_ENTRIES)
    total, since = torch.zeros(len(stack.values), device=stack.values.device), 0
    curve: list[tuple[int, list[float]]] = []
    for step in range(settings.steps):
        observations, actions, masks = batches.next()
        losses = kind.loss(stack.weights, observations, actions, masks)
        stack.values.grad = stack.gradients(losses)
        clip(stack.values.grad, settings.clip)
        adam.param_groups[0]["lr"] = learning_rate(step, settings)
        adam.step()
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


def _check(data: Sequence[Demonstrations], seeds: Sequence[int], settings: TrainSettings) -> None:
    if not data:
        raise PlancurateError("train: no demonstrations were given")
    if len(data) != len(seeds):
        raise PlancurateError(
            f"train: {len(data)} data sets but {len(seeds)} seeds; give one seed a data set"
        )
    joints = {d.dof for d in data}
    if len(joints) > 1:
        raise PlancurateError(f"train: data sets of {sorted(joints)} joints; one stack is of one robot")
    for d in data:
        observed = tuple(name for name, _ in d.layout)
        if observed != settings.observation:
            raise PlancurateError(
                f"train: demonstrations show the observation {', '.join(observed)}; "
                f"the settings ask for {', '.join(settings.observation)}"
            )
