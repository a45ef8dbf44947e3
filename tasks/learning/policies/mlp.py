"""BC_MLP: a multi-layer perceptron on single steps, mean squared error."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any, ClassVar, Literal

import torch
from pydantic import Field
from torch import Tensor

from plancurate.tasks.learning.policies.layers import linear_weights
from plancurate.tasks.learning.policies.policy import Policy, Weights, register


@register("BC_MLP")
class MLPPolicy(Policy):
    """Hidden layers between observation and action.

    Bounded units (tanh) rest at a target displaced from the trained ones; ReLU runs on past it.
    """

    recurrent = False
    robomimic: ClassVar[Mapping[str, Any]] = {"batch": 100, "hidden": (1024, 1024), "activation": "relu"}

    batch: int = Field(256, ge=1, description="steps in each gradient step")
    hidden: tuple[int, ...] = Field((256, 256), min_length=1, description="units of each hidden layer")
    activation: Literal["tanh", "relu"] = Field("tanh", description="what each hidden unit does")

    def initial(self, observed: int, acted: int, rng: torch.Generator) -> dict[str, Tensor]:
        """Draw one network's parameters."""
        sizes = (observed, *self.hidden, acted)
        weights: dict[str, Tensor] = {}
        for k, (inputs, outputs) in enumerate(pairwise(sizes)):
            weights |= linear_weights(f"layer_{k}", inputs, outputs, rng)
        return weights

    def loss(self, weights: Weights, observations: Tensor, actions: Tensor, masks: Tensor | None) -> Tensor:
        """Mean squared error of each network."""
        predicted = self._act(weights, observations.flatten(1, 2))
        return (predicted - actions.flatten(1, 2)).square().mean((1, 2))

    def step(
        self, weights: Weights, observation: Tensor, memory: Tensor | None
    ) -> tuple[Tensor, Tensor | None]:
        """Act on one observation; nothing is remembered."""
        return self._act(weights, observation), None

    def _act(self, weights: Weights, x: Tensor) -> Tensor:
        bend = torch.tanh if self.activation == "tanh" else torch.relu
        for k in range(len(self.hidden)):
            x = bend(torch.baddbmm(weights[f"layer_{k}.bias"], x, weights[f"layer_{k}.weight"]))
        last = f"layer_{len(self.hidden)}"
        return torch.baddbmm(weights[f"{last}.bias"], x, weights[f"{last}.weight"])
