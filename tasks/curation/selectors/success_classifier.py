"""A small network that tells states of successful rollouts from those of failed ones."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn.functional import binary_cross_entropy_with_logits

from plancurate.tasks.curation.selectors.networks import in_blocks, one_thread, perceptron
from plancurate.tasks.learning.demonstrations import Float32Array, FloatArray

HIDDEN = (8, 8)
DROPOUT = 0.3
LEARNING_RATE = 1e-3
WEIGHT_DECAY = 0.1
BATCH = 1024
LOOK_EVERY = 100
"""Steps between looks at the held rollouts; the weights that do best there are kept."""


@dataclass(frozen=True, eq=False)
class Labelled:
    """Standardised states and what became of the rollouts that came through them."""

    states: Float32Array
    """(steps, o)."""
    success: Float32Array
    """(steps,): 1 or 0."""

    @property
    def one_sided(self) -> bool:
        """Whether all rollouts ended alike, so that nothing can be told apart."""
        return len(np.unique(self.success)) < 2

    def weights(self) -> Tensor:
        """Weights (steps,) with which successes and failures count as much, 1 in the mean."""
        share = self.success.mean()
        return torch.from_numpy(np.where(self.success > 0, 0.5 / share, 0.5 / (1 - share)).astype(np.float32))


@dataclass(frozen=True, eq=False)
class Classifier:
    """A trained network and how well it does on rollouts that it has not seen."""

    network: nn.Sequential
    held_loss: float

    def probability(self, states: Float32Array) -> FloatArray:
        """Chance of success (steps,) of standardised states (steps, o)."""
        logits = in_blocks(self.network, states)[:, 0].astype(np.float64)
        return np.asarray(1 / (1 + np.exp(-logits)))


def fit(shown: Labelled, held: Sequence[Labelled], steps: int, rng: torch.Generator) -> Classifier:
    """Train on some rollouts and keep the weights of the least loss on others; both must hold both outcomes."""
    network = perceptron((shown.states.shape[1], *HIDDEN, 1), rng)
    adam = torch.optim.AdamW(network.parameters(), lr=LEARNING_RATE, weight_decay=WEIGHT_DECAY)
    states, success = torch.from_numpy(shown.states), torch.from_numpy(shown.success)
    weights = shown.weights()
    best = Classifier(network, np.inf)
    with one_thread():
        for step in range(1, steps + 1):
            rows = torch.randint(len(states), (BATCH,), generator=rng)
            logits = with_dropout(network, states[rows], rng)[:, 0]
            adam.zero_grad()
            binary_cross_entropy_with_logits(logits, success[rows], weights[rows]).backward()  # type: ignore[no-untyped-call]
            adam.step()
            if step % LOOK_EVERY == 0 or step == steps:
                loss = float(np.mean([held_loss(network, one) for one in held]))
                if loss < best.held_loss:
                    best = Classifier(copy.deepcopy(network), loss)
    return best


def with_dropout(network: nn.Sequential, values: Tensor, rng: torch.Generator) -> Tensor:
    """Outputs (b, 1) where units behind each ReLU are left out at random, by this generator and no other."""
    for layer in network:
        values = layer(values)
        if isinstance(layer, nn.ReLU):
            values = values * (torch.rand(values.shape, generator=rng) >= DROPOUT) / (1 - DROPOUT)
    return values


def held_loss(network: nn.Sequential, held: Labelled) -> float:
    """Mean cross-entropy per step, successes and failures counting as much."""
    with torch.no_grad():
        logits = network(torch.from_numpy(held.states))[:, 0]
        return float(binary_cross_entropy_with_logits(logits, torch.from_numpy(held.success), held.weights()))
