"""BC_RNN_MDN: the recurrent network with a mixture-density head, negative log-likelihood."""

from __future__ import annotations

import math
from typing import Literal

import torch
from pydantic import Field
from torch import Tensor
from torch.nn import functional

from plancurate.tasks.learning.policies.policy import Policy, Weights, register
from plancurate.tasks.learning.policies.rnn import RNNPolicy


@register("BC_RNN_MDN")
class MixtureRNNPolicy(RNNPolicy):
    """Gaussians with diagonal covariance over the action; the head gives logits, means and spreads."""

    components: int = Field(5, ge=1, description="Gaussians of the mixture")
    min_std: float = Field(
        0.3,
        gt=0,
        description="least spread, in standardised actions: without it still steps rule the likelihood",
    )
    mode: Literal["likeliest", "mean", "drawn"] = Field(
        "likeliest",
        description="a rollout takes the mean of the heaviest component, of the mixture, or of one drawn by weight",
    )

    def outputs(self, acted: int) -> int:
        """A logit, `acted` means and `acted` spreads a component."""
        return self.components * (1 + 2 * acted)

    def error(self, head: Tensor, actions: Tensor) -> Tensor:
        """Negative log-likelihood (S,) a step."""
        log_weight, mean, std = self.mixture(head)
        z = (actions[..., None, :] - mean) / std
        log_density = (
            -0.5 * z.square().sum(-1) - std.log().sum(-1) - 0.5 * math.log(2 * math.pi) * mean.shape[-1]
        )
        return -torch.logsumexp(log_weight + log_density, dim=-1).mean(1)

    def choose(self, head: Tensor) -> Tensor:
        """Actions (S, b, n) by `mode`."""
        log_weight, mean, _ = self.mixture(head)
        if self.mode == "mean":
            return (log_weight.exp()[..., None] * mean).sum(-2)
        if self.mode == "drawn":
            drawn = torch.multinomial(log_weight.exp().flatten(0, 1), 1).view(log_weight.shape[:2])
        else:
            drawn = log_weight.argmax(-1)
        return mean.gather(-2, drawn[..., None, None].expand(*mean.shape[:2], 1, mean.shape[-1])).squeeze(-2)

    def proposals(self, count: int) -> list[Policy]:
        """Act by the heaviest component, by the mean of the mixture, then by components drawn in each step."""
        modes = ["likeliest", "mean", *["drawn"] * (count - 2)]
        return [self.model_copy(update={"mode": mode}) for mode in modes[:count]]

    def diagnostics(self, weights: Weights, observations: Tensor) -> dict[str, Tensor]:
        """Say how many components act, and how wide the heaviest one is (standardised actions).

        Effective components are the exponential of the weights' entropy, averaged over the steps.
        """
        log_weight, _, std = self.mixture(self.heads(weights, observations))
        entropy = -(log_weight.exp() * log_weight).sum(-1)
        heaviest = log_weight.argmax(-1)[..., None, None].expand(*std.shape[:2], 1, std.shape[-1])
        return {
            "heaviest_weight": log_weight.exp().amax(-1).mean(1),
            "effective_components": entropy.exp().mean(1),
            "spread": std.gather(-2, heaviest).mean((1, 2, 3)),
        }

    def mixture(self, head: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Log weights (S, b, K), means (S, b, K, n) and standard deviations (S, b, K, n)."""
        k = self.components
        logits, rest = head[..., :k], head[..., k:]
        mean, spread = rest.reshape(*rest.shape[:-1], 2, k, -1).unbind(-3)
        return torch.log_softmax(logits, dim=-1), mean, functional.softplus(spread) + self.min_std
