"""BC_RNN: a gated recurrent network on windows of steps, sequence-wise mean squared error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import torch
from pydantic import Field
from torch import Tensor

from plancurate.tasks.learning.policies.layers import gru, gru_cell, gru_weights, linear_weights
from plancurate.tasks.learning.policies.policy import Policy, Weights, register

PARTS = ("input", "hidden", "input_bias", "hidden_bias")


@register("BC_RNN")
class RNNPolicy(Policy):
    """GRU layers and a linear head."""

    recurrent = True
    robomimic: ClassVar[Mapping[str, Any]] = {"batch": 100, "hidden": 400, "layers": 2}

    batch: int = Field(32, ge=1, description="windows in each gradient step")
    hidden: int = Field(64, ge=1, description="units of each layer")
    layers: int = Field(1, ge=1, description="layers, one upon the other")

    def outputs(self, acted: int) -> int:
        """Numbers that the head gives for `acted` joints."""
        return acted

    def initial(self, observed: int, acted: int, rng: torch.Generator) -> dict[str, Tensor]:
        """Draw one network's parameters."""
        weights: dict[str, Tensor] = {}
        for k in range(self.layers):
            weights |= gru_weights(f"gru_{k}", observed if k == 0 else self.hidden, self.hidden, rng)
        return weights | linear_weights("head", self.hidden, self.outputs(acted), rng)

    def loss(self, weights: Weights, observations: Tensor, actions: Tensor, masks: Tensor | None) -> Tensor:
        """Error of each network over all steps of all windows."""
        return self.error(self.heads(weights, observations, masks), actions.flatten(1, 2))

    def heads(self, weights: Weights, observations: Tensor, masks: Tensor | None = None) -> Tensor:
        """Head outputs (S, window * batch, outputs) at all steps of windows (S, window, batch, o).

        Masks (S, batch, o + 2 * layers * hidden), each the same at all steps of a window, are of the inputs of each
        layer and of the head, then of the state of each layer as its gates see it.
        """
        x = observations
        into, recurrent = self._split(masks, observations.shape[-1])
        for k in range(self.layers):
            x = gru(_times(x, into[k]), *_layer(weights, k), recurrent[k])
        x = _times(x, into[-1])
        return torch.baddbmm(weights["head.bias"], x.flatten(1, 2), weights["head.weight"])

    def _split(
        self, masks: Tensor | None, observed: int
    ) -> tuple[Sequence[Tensor | None], Sequence[Tensor | None]]:
        """Masks of what goes into each layer and the head, and of the state of each layer."""
        if masks is None:
            return [None] * (self.layers + 1), [None] * self.layers
        parts = torch.split(masks, [observed, *[self.hidden] * (2 * self.layers)], dim=-1)
        return parts[: self.layers + 1], parts[self.layers + 1 :]

    def step(
        self, weights: Weights, observation: Tensor, memory: Tensor | None
    ) -> tuple[Tensor, Tensor | None]:
        """Act on one observation; memory (layers, S, b, hidden) holds the hidden states."""
        if memory is None:
            memory = observation.new_zeros(self.layers, *observation.shape[:2], self.hidden)
        states: list[Tensor] = []
        x = observation
        for k in range(self.layers):
            x = gru_cell(x, memory[k], *_layer(weights, k))
            states.append(x)
        head = torch.baddbmm(weights["head.bias"], x, weights["head.weight"])
        return self.choose(head), torch.stack(states)

    def error(self, head: Tensor, actions: Tensor) -> Tensor:
        """Losses (S,) of head outputs (S, b, outputs) against actions (S, b, n)."""
        return (head - actions).square().mean((1, 2))

    def choose(self, head: Tensor) -> Tensor:
        """Actions (S, b, n) from head outputs (S, b, outputs)."""
        return head


def _times(x: Tensor, mask: Tensor | None) -> Tensor:
    """Values (S, window, batch, k) times a mask (S, batch, k)."""
    return x if mask is None else x * mask[:, None]


def _layer(weights: Weights, k: int) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    input, hidden, input_bias, hidden_bias = (weights[f"gru_{k}.{part}"] for part in PARTS)
    return input, hidden, input_bias, hidden_bias
