"""Parameters of S networks of one shape in one table, so that each operation serves them all."""

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


class Adam:
    """Adam with decoupled weight decay, the gradient of each network clipped by its own norm."""

    def __init__(self, stack: ParameterStack, clip: float, weight_decay: float) -> None:
        self.values, self.clip, self.weight_decay = stack.values, clip, weight_decay
        self.mean = torch.zeros_like(stack.values)
        self.square = torch.zeros_like(stack.values)
        self.taken = 0

    @torch.no_grad()
    def step(
        self, g: Tensor, learning_rate: float, beta1: float = 0.9, beta2: float = 0.999, eps: float = 1e-8
    ) -> None:
        """Take one step down the gradients g (S, numbers), which are clipped in place."""
        self.taken += 1
        norm = g.square().view(len(g), -1, ALIGN).sum(2).sum(1, keepdim=True).sqrt()
        g.mul_((self.clip / (norm + 1e-6)).clamp(max=1.0))
        self.values.mul_(1 - learning_rate * self.weight_decay)
        self.mean.lerp_(g, 1 - beta1)
        self.square.mul_(beta2).addcmul_(g, g, value=1 - beta2)
        spread = self.square.sqrt().div_(math.sqrt(1 - beta2**self.taken)).add_(eps)
        self.values.addcdiv_(self.mean, spread, value=-learning_rate / (1 - beta1**self.taken))
