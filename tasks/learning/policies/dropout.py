"""BC_RNN_Dropout: the recurrent network with variational dropout."""

from __future__ import annotations

import torch
from pydantic import Field
from torch import Tensor

from plancurate.tasks.learning.policies.policy import register
from plancurate.tasks.learning.policies.rnn import RNNPolicy


@register("BC_RNN_Dropout")
class DropoutRNNPolicy(RNNPolicy):
    """Each layer's output passes one mask a window: the same units are silent at all its steps.

    None is silent in a rollout.
    """

    dropout: float = Field(0.2, ge=0, lt=1, description="share of silent units in training")

    def masks(self, steps: int, rng: torch.Generator) -> Tensor:
        """Draw masks (steps, batch, layers, hidden) of 0 and 1 / (1 - dropout)."""
        kept = torch.rand(steps, self.batch, self.layers, self.hidden, generator=rng) >= self.dropout
        return kept / (1 - self.dropout)
