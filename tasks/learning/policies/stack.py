"""Parameters of S networks of one shape in one table, so that each operation serves them all.

torch.optim.AdamW steps on the whole table: it gives the bits of an Adam written out for it, at about the same speed.
Clipping is here, since each network has its own norm.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import torch
from torch import Tensor

ALIGN = 32
"""Each network's row is padded to a multiple of this many numbers, whole vector registers, so that its
arithmetic does not depend on its place in the stack."""


class ParameterStack:
    """Parameters as a table (S, numbers), with a view (S, ...) for each named parameter."""

    def __init__(self, networks: Sequence[Mapping[str, Tensor]], device: torch.device) -> None:
        shapes = {name: value.shape for name, value in networks[0].items()}
        self.count = sum(shape.numel() for shape in shapes.values())
        width = math.ceil(self.count / ALIGN) * ALIGN
        self.values = torch.zeros(len(networks), width, device=device)
        self.weights: dict[str, Tensor] = {}
        begin = 0
        for name, shape in shapes.items():
            view = self.values[:, begin : begin + shape.numel()].view(len(networks), *shape)
            view.copy_(torch.stack([network[name] for network in networks]))
            self.weights[name] = view.requires_grad_()
            begin += shape.numel()

    def gradients(self, losses: Tensor) -> Tensor:
        """Table (S, numbers): derivatives of each network's loss in losses (S,) by its own parameters."""
        parts = torch.autograd.grad(losses.sum(), list(self.weights.values()))
        padding = self.values.new_zeros(len(losses), self.values.shape[1] - self.count)
        return torch.cat([*(part.flatten(1) for part in parts), padding], dim=1)

    def network(self, s: int) -> dict[str, Tensor]:
        """A copy of one network's parameters, without the dimension S, on the CPU."""
        return {name: value[s].detach().cpu().clone() for name, value in self.weights.items()}


def clip(gradients: Tensor, largest: float) -> None:
    """Shorten, in place, the gradients (S, numbers) of each network to the norm `largest`, if they are longer."""
    norm = gradients.square().view(len(gradients), -1, ALIGN).sum(2).sum(1, keepdim=True).sqrt()
    gradients.mul_((largest / (norm + 1e-6)).clamp(max=1.0))
