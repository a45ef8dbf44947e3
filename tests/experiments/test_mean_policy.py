"""The mean of several trainings: what the one wide network does, against what each does by itself."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import pytest
import torch

from plancurate.tasks.learning.policies import Normaliser, TrainedPolicy, kind_of
from plancurate.tasks.learning.policies.acting import ActingStack

EXPERIMENTS = Path(__file__).parents[2] / "experiments"
LAYOUT = (("target_offset", 3), ("joint_positions", 6))


@pytest.fixture
def module(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The experiment's module."""
    monkeypatch.syspath_prepend(EXPERIMENTS)
    import mean_policy  # type: ignore[import-not-found]

    return mean_policy


def drawn(hidden: tuple[int, ...], activation: str, seed: int) -> TrainedPolicy:
    """A policy with random weights and biases, and a standardisation that all of them share."""
    kind = kind_of("BC_MLP")(hidden=hidden, activation=activation)
    weights = kind.initial(9, 6, torch.Generator().manual_seed(seed))
    normaliser = Normaliser(torch.arange(9.0), torch.arange(1.0, 10), torch.arange(6.0), torch.arange(2.0, 8))
    return TrainedPolicy(kind, weights, normaliser, LAYOUT, "delta", 10, seed)


@pytest.mark.parametrize("hidden", [(5,), (5, 3), (4, 6, 2)])
@pytest.mark.parametrize("activation", ["tanh", "relu"])
@pytest.mark.parametrize("count", [1, 4])
def test_it_does_the_mean_of_what_each_does(
    module: ModuleType, hidden: tuple[int, ...], activation: str, count: int
) -> None:
    policies = [drawn(hidden, activation, seed) for seed in range(count)]
    rng = torch.Generator().manual_seed(7)
    seen = torch.randn(1, 50, 9, generator=rng, dtype=torch.float64) * 10
    q = torch.randn(1, 50, 6, generator=rng, dtype=torch.float64)
    mean = ActingStack([module.mean_policy(policies)]).next_q(seen, q)
    each = ActingStack(policies).next_q(seen.expand(count, -1, -1), q.expand(count, -1, -1))
    torch.testing.assert_close(mean[0], each.mean(0), rtol=1e-5, atol=1e-5)
