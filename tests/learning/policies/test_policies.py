from __future__ import annotations

import math

import pytest
import torch
from torch import distributions

from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.tasks.learning.policies import kind_of, make_policy, policy_names
from plancurate.tasks.learning.policies.dropout import DropoutRNNPolicy
from plancurate.tasks.learning.policies.mixture import MixtureRNNPolicy
from plancurate.tasks.learning.policies.policy import Policy, Weights
from plancurate.tasks.learning.settings import TrainSettings

OBSERVED, ACTED = 9, 6


def weights_of(policy: Policy, networks: int = 2) -> Weights:
    rng = torch.Generator().manual_seed(3)
    drawn = [policy.initial(OBSERVED, ACTED, rng) for _ in range(networks)]
    return {name: torch.stack([one[name] for one in drawn]) for name in drawn[0]}


def random(*shape: int, seed: int = 4) -> torch.Tensor:
    return torch.randn(shape, generator=torch.Generator().manual_seed(seed))


def test_the_four_policies_of_the_publication_are_registered() -> None:
    assert {"BC_MLP", "BC_RNN", "BC_RNN_Dropout", "BC_RNN_MDN"} <= set(policy_names())


def test_unknown_policy_and_setting_name_the_nearest() -> None:
    with pytest.raises(UnknownNameError, match="did you mean BC_RNN"):
        make_policy("BC_RRN", {})
    with pytest.raises(UnknownNameError, match="did you mean dropout"):
        make_policy("BC_RNN_Dropout", {"droput": 0.3})


def test_value_out_of_range_names_policy_field_and_value() -> None:
    with pytest.raises(PlancurateError, match=r"policies.BC_RNN_Dropout.dropout = 1.5"):
        make_policy("BC_RNN_Dropout", {"dropout": 1.5})


@pytest.mark.parametrize("name", ["BC_MLP", "BC_RNN", "BC_RNN_Dropout", "BC_RNN_MDN"])
def test_a_network_in_a_stack_acts_and_errs_as_it_does_alone(name: str) -> None:
    policy = make_policy(name, {})
    both = weights_of(policy)
    steps = 4 if policy.recurrent else 1
    observations, actions = random(2, steps, 8, OBSERVED), random(2, steps, 8, ACTED, seed=5)
    losses = policy.loss(both, observations, actions, None)
    for s in range(2):
        alone = {key: value[s : s + 1] for key, value in both.items()}
        loss = policy.loss(alone, observations[s : s + 1], actions[s : s + 1], None)
        torch.testing.assert_close(loss, losses[s : s + 1])
        memory, memory_alone = None, None
        for t in range(steps):
            action, memory = policy.step(both, observations[:, t], memory)
            action_alone, memory_alone = policy.step(alone, observations[s : s + 1, t], memory_alone)
            torch.testing.assert_close(action_alone[0], action[s])


@pytest.mark.parametrize("name", ["BC_MLP", "BC_RNN"])
def test_squared_error_of_the_loss_is_that_of_the_actions_taken(name: str) -> None:
    policy = make_policy(name, {"layers": 2} if name == "BC_RNN" else {})
    weights = weights_of(policy)
    steps = 5 if policy.recurrent else 1
    observations, actions = random(2, steps, 8, OBSERVED), random(2, steps, 8, ACTED, seed=5)
    memory, taken = None, []
    for t in range(steps):
        action, memory = policy.step(weights, observations[:, t], memory)
        taken.append(action)
    expected = (torch.stack(taken, dim=1) - actions).square().mean((1, 2, 3))
    torch.testing.assert_close(policy.loss(weights, observations, actions, None), expected)


def written_out(
    policy: DropoutRNNPolicy, weights: Weights, x: torch.Tensor, masks: torch.Tensor
) -> torch.Tensor:
    """Head outputs (T, b, outputs) of one network on x (T, b, o) with masks (b, ...), one step at a time.

    A gated recurrent unit as torch.nn.GRU has it, with the dropout of Gal and Ghahramani: a mask of their own for
    the inputs of each layer, the input of the head and the state of each layer, the same at every step.
    """
    hidden, layers = policy.hidden, policy.layers
    into, first = [masks[:, :OBSERVED]], OBSERVED
    for _ in range(layers):
        into.append(masks[:, first : first + hidden])
        first += hidden
    state_masks = [masks[:, first + k * hidden : first + (k + 1) * hidden] for k in range(layers)]
    states = [torch.zeros(x.shape[1], hidden, dtype=x.dtype) for _ in range(layers)]
    outputs = []
    for step in x:
        value = step
        for k in range(layers):
            part = {
                name: weights[f"gru_{k}.{name}"][0]
                for name in ("input", "hidden", "input_bias", "hidden_bias")
            }
            from_input = (value * into[k]) @ part["input"] + part["input_bias"]
            from_state = (states[k] * state_masks[k]) @ part["hidden"] + part["hidden_bias"]
            (r_i, z_i, n_i), (r_h, z_h, n_h) = from_input.chunk(3, -1), from_state.chunk(3, -1)
            reset, update = torch.sigmoid(r_i + r_h), torch.sigmoid(z_i + z_h)
            new = torch.tanh(n_i + reset * n_h)
            states[k] = (1 - update) * new + update * states[k]
            value = states[k]
        outputs.append((value * into[layers]) @ weights["head.weight"][0] + weights["head.bias"][0])
    return torch.stack(outputs)


@pytest.mark.parametrize("layers", [1, 2])
def test_dropout_equals_a_recurrence_written_out_step_by_step(layers: int) -> None:
    policy = DropoutRNNPolicy(hidden=5, batch=3, dropout=0.4, layers=layers)
    weights = {name: value.double().requires_grad_() for name, value in weights_of(policy).items()}
    x = random(2, 7, 3, OBSERVED).double()
    masks = policy.masks(2, OBSERVED, torch.Generator().manual_seed(0)).double()
    heads = policy.heads(weights, x, masks).view(2, 7, 3, ACTED)
    gradients = torch.autograd.grad(heads.pow(3).sum(), list(weights.values()))
    for s in range(2):
        alone = {name: value[s : s + 1].detach().requires_grad_() for name, value in weights.items()}
        expected = written_out(policy, alone, x[s], masks[s])
        torch.testing.assert_close(heads[s], expected)
        others = torch.autograd.grad(expected.pow(3).sum(), list(alone.values()))
        for gradient, other in zip(gradients, others, strict=True):
            torch.testing.assert_close(gradient[s : s + 1], other)
    ones = policy.heads(weights, x, torch.ones_like(masks))
    torch.testing.assert_close(ones, policy.heads(weights, x))


def test_dropout_masks_have_mean_one_and_the_asked_share_of_silence() -> None:
    policy = DropoutRNNPolicy(hidden=100, batch=50, dropout=0.3, layers=2)
    masks = policy.masks(4, OBSERVED, torch.Generator().manual_seed(0))
    assert masks.shape == (4, 50, OBSERVED + 4 * 100)
    assert (masks == 0).double().mean() == pytest.approx(0.3, abs=0.02)
    assert masks.mean() == pytest.approx(1.0, abs=0.03)


def test_dropout_is_off_in_a_rollout() -> None:
    settings = {"hidden": 16}
    with_dropout, without = make_policy("BC_RNN_Dropout", settings), make_policy("BC_RNN", settings)
    weights = weights_of(without)
    observation = random(2, 4, OBSERVED)
    torch.testing.assert_close(
        with_dropout.step(weights, observation, None),
        without.step(weights, observation, None),
        rtol=0,
        atol=0,
    )


def peer_mixture(policy: MixtureRNNPolicy, head: torch.Tensor) -> distributions.Distribution:
    log_weight, mean, std = policy.mixture(head)
    return distributions.MixtureSameFamily(
        distributions.Categorical(logits=log_weight),
        distributions.Independent(distributions.Normal(mean, std), 1),
    )


def test_mixture_loss_equals_the_likelihood_of_torch_distributions() -> None:
    policy = MixtureRNNPolicy(components=4)
    head, actions = random(3, 20, policy.outputs(ACTED)), random(3, 20, ACTED, seed=6)
    expected = -peer_mixture(policy, head).log_prob(actions).mean(1)
    torch.testing.assert_close(policy.error(head, actions), expected)


def test_mixture_spread_stays_above_its_floor() -> None:
    policy = MixtureRNNPolicy(components=2, min_std=0.2)
    assert policy.mixture(-100 * random(1, 50, policy.outputs(ACTED)).abs())[2].min() >= 0.2


def test_mixture_acts_by_its_heaviest_component_or_its_mean() -> None:
    likeliest, mean = (MixtureRNNPolicy(components=3, mode=mode) for mode in ("likeliest", "mean"))
    head = random(2, 10, likeliest.outputs(ACTED))
    log_weight, means, _ = likeliest.mixture(head)
    chosen = likeliest.choose(head)
    for s in range(2):
        for b in range(10):
            torch.testing.assert_close(chosen[s, b], means[s, b, log_weight[s, b].argmax()])
    torch.testing.assert_close(mean.choose(head), peer_mixture(mean, head).mean)


def test_mlp_bends_by_tanh_unless_asked_for_relu() -> None:
    weights = weights_of(make_policy("BC_MLP", {}))
    far = 1e6 * random(2, 4, OBSERVED)
    tanh = make_policy("BC_MLP", {}).step(weights, far, None)[0]
    relu = make_policy("BC_MLP", {"activation": "relu"}).step(weights, far, None)[0]
    assert tanh.abs().max() < 20 < relu.abs().max()


def test_robomimic_sizes_are_accepted_and_single_settings_go_over_them() -> None:
    settings = TrainSettings(size="robomimic", policies={"BC_RNN": {"hidden": 8}})
    assert settings.policy("BC_MLP") == make_policy("BC_MLP", dict(kind_of("BC_MLP").robomimic))
    assert settings.policy("BC_RNN_MDN").model_dump()["hidden"] == 400
    assert settings.policy("BC_RNN").model_dump()["layers"] == 2
    assert settings.policy("BC_RNN").model_dump()["hidden"] == 8
    assert TrainSettings().policy("BC_RNN") == make_policy("BC_RNN", {})


def test_a_mixture_tells_how_many_components_act_and_how_wide_they_are() -> None:
    policy = make_policy("BC_RNN_MDN", {"components": 4, "hidden": 8})
    weights = {name: torch.zeros_like(value) for name, value in weights_of(policy, networks=1).items()}
    told = policy.diagnostics(weights, torch.randn(1, 3, 2, OBSERVED))
    assert told["heaviest_weight"].item() == pytest.approx(0.25)
    assert told["effective_components"].item() == pytest.approx(4, rel=1e-5)
    assert told["spread"].item() == pytest.approx(math.log(2) + 0.3, rel=1e-5)
