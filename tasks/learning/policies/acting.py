"""Trained policies acting side by side: observations in, next joint angles out."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from plancurate.tasks.learning.policies.device import usable
from plancurate.tasks.learning.policies.trained import Normaliser, TrainedPolicy


class ActingStack:
    """S trained networks of one kind, each with b rollouts of its own; remembers where each rollout is."""

    def __init__(self, policies: Sequence[TrainedPolicy], device: str = "cpu") -> None:
        first = policies[0]
        self.policy, self.action, self.window = first.policy, first.action, first.window
        self.device = usable(device)
        self.weights = {
            name: torch.stack([policy.weights[name] for policy in policies]).to(self.device)
            for name in first.weights
        }
        self.normaliser = stack_normalisers([policy.normaliser for policy in policies], self.device)
        self.memory: Tensor | None = None
        self.taken = 0

    def reset(self) -> None:
        """Begin new rollouts."""
        self.memory, self.taken = None, 0

    @torch.no_grad()
    def next_q(self, observation: Tensor) -> Tensor:
        """Next joint angles (S, b, n) in float64 for observations (S, b, 3 + n) in float64."""
        if self.taken % self.window == 0:
            self.memory = None
        self.taken += 1
        norm = self.normaliser
        seen = (observation.float().to(self.device) - norm.observation_mean) / norm.observation_scale
        action, self.memory = self.policy.step(self.weights, seen, self.memory)
        action = (action * norm.action_scale + norm.action_mean).double().cpu()
        return observation[..., 3:] + action if self.action == "delta" else action


def stack_normalisers(normalisers: Sequence[Normaliser], device: torch.device) -> Normaliser:
    """One normaliser of tensors (S, 1, o) and (S, 1, n)."""
    fields = Normaliser.__dataclass_fields__
    return Normaliser(
        **{name: torch.stack([getattr(n, name) for n in normalisers])[:, None].to(device) for name in fields}
    )
