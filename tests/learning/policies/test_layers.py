from __future__ import annotations

import pytest
import torch

from plancurate.tasks.learning.policies.layers import gru, gru_cell, gru_weights

NETWORKS, STEPS, BATCH, INPUTS, HIDDEN = 3, 7, 5, 4, 6
PARTS = ("input", "hidden", "input_bias", "hidden_bias")


def stacked_weights() -> list[torch.Tensor]:
    rng = torch.Generator().manual_seed(1)
    drawn = [gru_weights("g", INPUTS, HIDDEN, rng) for _ in range(NETWORKS)]
    return [torch.stack([one[f"g.{part}"] for one in drawn]).double() for part in PARTS]


def torch_gru(weights: list[torch.Tensor], s: int) -> torch.nn.GRU:
    peer = torch.nn.GRU(INPUTS, HIDDEN).double()
    names = ("weight_ih_l0", "weight_hh_l0", "bias_ih_l0", "bias_hh_l0")
    with torch.no_grad():
        for name, weight in zip(names, weights, strict=True):
            getattr(peer, name).copy_(weight[s].T.squeeze())
    return peer


@pytest.fixture
def inputs() -> torch.Tensor:
    return torch.randn(
        NETWORKS, STEPS, BATCH, INPUTS, generator=torch.Generator().manual_seed(2), dtype=torch.float64
    )


def test_stacked_gru_equals_torch_gru_in_values_and_gradients(inputs: torch.Tensor) -> None:
    weights = [weight.requires_grad_() for weight in stacked_weights()]
    inputs.requires_grad_()
    states = gru(inputs, *weights)
    gradients = torch.autograd.grad(states.pow(3).sum(), [inputs, *weights])
    for s in range(NETWORKS):
        peer = torch_gru(weights, s)
        x = inputs[s].detach().requires_grad_()
        expected = peer(x)[0]
        torch.testing.assert_close(states[s], expected)
        found = torch.autograd.grad(expected.pow(3).sum(), [x, *peer.parameters()])
        torch.testing.assert_close(gradients[0][s], found[0])
        for gradient, other in zip(gradients[1:], found[1:], strict=True):
            torch.testing.assert_close(gradient[s].T.squeeze(), other)


def test_cell_step_by_step_equals_the_recurrence(inputs: torch.Tensor) -> None:
    weights = stacked_weights()
    h = torch.zeros(NETWORKS, BATCH, HIDDEN, dtype=torch.float64)
    for t, expected in enumerate(gru(inputs, *weights).unbind(1)):
        h = gru_cell(inputs[:, t], h, *weights)
        torch.testing.assert_close(h, expected)
