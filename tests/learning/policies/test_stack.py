from __future__ import annotations

import torch

from plancurate.tasks.learning.policies.stack import ParameterStack, clip

NETWORKS = 3


def networks() -> list[dict[str, torch.Tensor]]:
    rng = torch.Generator().manual_seed(0)
    return [
        {"a": torch.randn(4, 7, generator=rng), "b": torch.randn(1, 7, generator=rng)}
        for _ in range(NETWORKS)
    ]


def loss(weights: dict[str, torch.Tensor], scale: float) -> torch.Tensor:
    return scale * (weights["a"].sin() * weights["b"]).flatten(-2).square().sum(-1)


def test_stack_gives_each_network_its_own_parameters_back() -> None:
    stack = ParameterStack(networks(), torch.device("cpu"))
    for s, network in enumerate(networks()):
        for name, value in stack.network(s).items():
            assert torch.equal(value, network[name])


def test_steps_on_the_table_equal_those_of_each_network_clipped_alone() -> None:
    stack = ParameterStack(networks(), torch.device("cpu"))
    adam = torch.optim.AdamW([stack.values], weight_decay=0.5)
    for step in range(20):
        stack.values.grad = stack.gradients(loss(stack.weights, 0.3))
        clip(stack.values.grad, 1.0)
        adam.param_groups[0]["lr"] = 0.01 * (step + 1)
        adam.step()
    for s, network in enumerate(networks()):
        leaves = {name: value.clone().requires_grad_() for name, value in network.items()}
        peer = torch.optim.AdamW(leaves.values(), lr=0.01, weight_decay=0.5)
        for step in range(20):
            peer.param_groups[0]["lr"] = 0.01 * (step + 1)
            peer.zero_grad()
            loss(leaves, 0.3).backward()
            torch.nn.utils.clip_grad_norm_(leaves.values(), 1.0)
            peer.step()
        for name, value in stack.network(s).items():
            torch.testing.assert_close(value, leaves[name].detach())
