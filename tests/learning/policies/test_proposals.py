from __future__ import annotations

import torch

from plancurate.tasks.learning.policies import make_policy


def head(rng: torch.Generator) -> torch.Tensor:
    return torch.randn(1, 50, 5 * (1 + 2 * 6), generator=rng)


def test_a_mixture_proposes_its_heaviest_component_first_then_its_mean_then_draws():
    policy = make_policy("BC_RNN_MDN", {})
    outputs = head(torch.Generator().manual_seed(0))
    likeliest, mean, *drawn = policy.proposals(4)
    assert len(drawn) == 2
    assert torch.equal(likeliest.choose(outputs), policy.choose(outputs))
    log_weight, means, _ = policy.mixture(outputs)
    torch.testing.assert_close(mean.choose(outputs), (log_weight.exp()[..., None] * means).sum(-2))
    torch.manual_seed(1)
    first, second = drawn[0].choose(outputs), drawn[0].choose(outputs)
    torch.manual_seed(1)
    assert torch.equal(drawn[1].choose(outputs), first)
    assert not torch.equal(first, second)


def test_components_are_drawn_by_their_weights():
    (drawn,) = make_policy("BC_RNN_MDN", {"mode": "drawn"}).proposals(3)[2:]
    outputs = head(torch.Generator().manual_seed(0))[:, :1]
    log_weight, means, _ = drawn.mixture(outputs)
    torch.manual_seed(0)
    actions = drawn.choose(outputs.expand(1, 4000, -1).contiguous())
    shares = torch.stack([(actions == means[:, :, k]).all(-1).float().mean() for k in range(5)])
    torch.testing.assert_close(shares, log_weight.exp()[0, 0], atol=0.03, rtol=0)


def test_other_policies_have_one_way_to_act():
    for name in ("BC_MLP", "BC_RNN", "BC_RNN_Dropout"):
        policy = make_policy(name, {})
        assert policy.proposals(4) == [policy]
