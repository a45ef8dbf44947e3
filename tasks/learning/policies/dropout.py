"""BC_RNN_Dropout: the recurrent network with variational dropout.

Gal and Ghahramani: A Theoretically Grounded Application of Dropout in Recurrent Neural Networks, 2016.
"""

from __future__ import annotations

from typing import ClassVar

import torch
from pydantic import Field
from torch import Tensor

from plancurate.tasks.learning.policies.policy import register
from plancurate.tasks.learning.policies.rnn import RNNPolicy


@register("BC_RNN_Dropout")
class DropoutRNNPolicy(RNNPolicy):
    """One mask a window on what goes into each layer and the head, and one on each recurrent state.

    The same units are silent at all steps of a window; none is silent in a rollout.
    """

    revision: ClassVar[int] = 2

    dropout: float = Field(0.2, ge=0, lt=1, description="share of silent units in training")

    def masks(self, steps: int, observed: int, rng: torch.Generator) -> Tensor:
        """Draw masks (steps, batch, observed + 2 * layers * hidden) of 0 and 1 / (1 - dropout)."""
        width = observed + 2 * self.layers * self.hidden
        kept = torch.rand(steps, self.batch, width, generator=rng) >= self.dropout
        return kept / (1 - self.dropout)
