"""The mean of several trainings as one policy: networks of one shape, side by side in one as wide as all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import torch
from torch import Tensor

from plancurate.tasks.learning.policies import TrainedPolicy
from plancurate.tasks.learning.policies.mlp import MLPPolicy


def mean_policy(policies: Sequence[TrainedPolicy]) -> TrainedPolicy:
    """The BC_MLP that gives the mean of what these give, which are alike but for the seeds of their training."""
    kind = policies[0].policy
    assert isinstance(kind, MLPPolicy)
    last = len(kind.hidden)
    weights: dict[str, Tensor] = {}
    for layer in range(last + 1):
        layers = [policy.weights[f"layer_{layer}.weight"] for policy in policies]
        biases = [policy.weights[f"layer_{layer}.bias"] for policy in policies]
        if layer == last:
            weights[f"layer_{layer}.weight"] = torch.cat(layers) / len(policies)
            weights[f"layer_{layer}.bias"] = torch.stack(biases).mean(0)
        else:
            joined = torch.cat(layers, dim=1) if layer == 0 else torch.block_diag(*layers)
            weights[f"layer_{layer}.weight"] = joined
            weights[f"layer_{layer}.bias"] = torch.cat(biases, dim=1)
    wide = kind.model_copy(update={"hidden": tuple(len(policies) * units for units in kind.hidden)})
    return replace(policies[0], policy=wide, weights=weights)
