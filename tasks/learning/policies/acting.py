"""Trained policies acting side by side: observations and joint angles in, next joint angles out."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from plancurate.errors import PlancurateError
from plancurate.tasks.learning.observations import Layout
from plancurate.tasks.learning.policies.device import usable
from plancurate.tasks.learning.policies.trained import Normaliser, TrainedPolicy


class ActingStack:
    """S trained networks of one kind, each with b rollouts of its own; remembers where each rollout is.

    Raises PlancurateError for networks that observe different terms.
    """

    def __init__(self, policies: Sequence[TrainedPolicy], device: str = "cpu") -> None:
        first = policies[0]
        for other in policies:
            require_layout(other, first.layout)
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
    def next_q(self, observation: Tensor, q: Tensor) -> Tensor:
        """Next joint angles (S, b, n) for observations (S, b, o) at joint angles q (S, b, n), all in float64."""
        if self.taken % self.window == 0:
            self.memory = None
        self.taken += 1
        norm = self.normaliser
        seen = (observation.float().to(self.device) - norm.observation_mean) / norm.observation_scale
        action, self.memory = self.policy.step(self.weights, seen, self.memory)
        action = (action * norm.action_scale + norm.action_mean).double().cpu()
        return q + action if self.action == "delta" else action


def require_layout(policy: TrainedPolicy, given: Layout) -> None:
    """Raise PlancurateError for a policy that was trained on other observation terms than those given."""
    if policy.layout != given:
        raise PlancurateError(
            f"{policy.policy.name} was trained on the observation {shown(policy.layout)}; "
            f"{shown(given)} can't be given to it: train it on that observation"
        )


def shown(parts: Layout) -> str:
    """Terms and their sizes for a person."""
    return ", ".join(f"{name} ({size})" for name, size in parts)


def stack_normalisers(normalisers: Sequence[Normaliser], device: torch.device) -> Normaliser:
    """One normaliser of tensors (S, 1, o) and (S, 1, n)."""
    fields = Normaliser.__dataclass_fields__
    return Normaliser(
        **{name: torch.stack([getattr(n, name) for n in normalisers])[:, None].to(device) for name in fields}
    )
