"""Layers of S stacked networks: linear maps and a gated recurrent unit with its derivative written out."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor


def uniform(rng: torch.Generator, *shape: int, bound: float) -> Tensor:
    """Numbers of the given shape in (-bound, bound)."""
    return (torch.rand(shape, generator=rng) * 2 - 1) * bound


def linear_weights(name: str, inputs: int, outputs: int, rng: torch.Generator) -> dict[str, Tensor]:
    """First parameters of one linear map, drawn as torch.nn.Linear draws them."""
    bound = inputs**-0.5
    return {
        f"{name}.weight": uniform(rng, inputs, outputs, bound=bound),
        f"{name}.bias": uniform(rng, 1, outputs, bound=bound),
    }


def gru_weights(name: str, inputs: int, hidden: int, rng: torch.Generator) -> dict[str, Tensor]:
    """First parameters of one GRU layer (gates reset, update, new), drawn as torch.nn.GRU draws them."""
    bound = hidden**-0.5
    return {
        f"{name}.input": uniform(rng, inputs, 3 * hidden, bound=bound),
        f"{name}.hidden": uniform(rng, hidden, 3 * hidden, bound=bound),
        f"{name}.input_bias": uniform(rng, 1, 3 * hidden, bound=bound),
        f"{name}.hidden_bias": uniform(rng, 1, 3 * hidden, bound=bound),
    }


def gru_cell(
    x: Tensor, h: Tensor, input: Tensor, hidden: Tensor, input_bias: Tensor, hidden_bias: Tensor
) -> Tensor:
    """Next hidden states (S, b, H) from inputs x (S, b, i) and hidden states h (S, b, H)."""
    size = h.shape[-1]
    gx = torch.baddbmm(input_bias, x, input)
    gh = torch.baddbmm(hidden_bias, h, hidden)
    r, z = torch.sigmoid(gx[..., : 2 * size] + gh[..., : 2 * size]).chunk(2, dim=-1)
    n = torch.tanh(gx[..., 2 * size :] + r * gh[..., 2 * size :])
    return torch.lerp(n, h, z)


def gru(
    x: Tensor,
    input: Tensor,
    hidden: Tensor,
    input_bias: Tensor,
    hidden_bias: Tensor,
    mask: Tensor | None = None,
) -> Tensor:
    """Hidden states (S, T, b, H) of T steps from inputs x (S, T, b, i), beginning at zero.

    The gates see hidden states times the mask (S, b, H), the same at all steps; None is a mask of ones.
    """
    states: Tensor = GatedRecurrence.apply(x, input, hidden, input_bias, hidden_bias, mask)  # type: ignore[no-untyped-call]
    return states


class GatedRecurrence(torch.autograd.Function):
    """`gru` with its derivative by hand: half the time, since each step stays in the cache.

    Gates of step t: r reset, z update, n new, with c the recurrent part of n before r is applied;
    h[t+1] = (1 - z) n + z h[t], n = tanh(a + r c). The recurrent parts of r, z and n are of h[t] times the mask.
    """

    @staticmethod
    def forward(
        ctx: Any,
        x: Tensor,
        input: Tensor,
        hidden: Tensor,
        input_bias: Tensor,
        hidden_bias: Tensor,
        mask: Tensor | None,
    ) -> Tensor:
        """Run the recurrence."""
        s, steps, b, i = x.shape
        size = hidden.shape[1]
        gx = torch.baddbmm(input_bias, x.reshape(s, steps * b, i), input).view(s, steps, b, 3 * size)
        h = x.new_zeros(s, steps + 1, b, size)
        gates = x.new_empty(s, steps, b, 3 * size)
        c = x.new_empty(s, steps, b, size)
        for t in range(steps):
            gh = torch.baddbmm(hidden_bias, _masked(h[:, t], mask), hidden)
            rz, n = gates[:, t, :, : 2 * size], gates[:, t, :, 2 * size :]
            torch.add(gx[:, t, :, : 2 * size], gh[..., : 2 * size], out=rz).sigmoid_()
            c[:, t] = gh[..., 2 * size :]
            torch.addcmul(gx[:, t, :, 2 * size :], rz[..., :size], c[:, t], out=n)
            n.mul_(2).sigmoid_().mul_(2).sub_(1)  # tanh, seven times faster on a CPU
            torch.lerp(n, h[:, t], rz[..., size:], out=h[:, t + 1])
        ctx.save_for_backward(x, input, hidden, h, gates, c, mask)
        return h[:, 1:]

    @staticmethod
    def backward(ctx: Any, *grads: Tensor) -> tuple[Tensor | None, Tensor, Tensor, Tensor, Tensor, None]:
        """Derivatives by x, input, hidden, input_bias, hidden_bias; none by the mask."""
        x, input, hidden, h, gates, c, mask = ctx.saved_tensors
        s, steps, b, i = x.shape
        size = hidden.shape[1]
        d = _gate_derivatives(grads[0], hidden, h, gates, c, mask).view(s, steps * b, 4 * size)
        flat_x = x.reshape(s, steps * b, i)
        flat_h = _masked(h[:, :-1], None if mask is None else mask[:, None]).reshape(s, steps * b, size)
        bias = d.sum(1, keepdim=True)
        by_input = torch.bmm(flat_x.transpose(1, 2), d)
        by_hidden = torch.bmm(flat_h.transpose(1, 2), d[..., : 3 * size])
        by_x = None
        if ctx.needs_input_grad[0]:
            by_x = torch.bmm(_input_gates(d, size), input.transpose(1, 2)).view_as(x)
        by_biases = _input_gates(bias, size), bias[..., : 3 * size]
        return by_x, _input_gates(by_input, size), by_hidden, *by_biases, None


def _masked(h: Tensor, mask: Tensor | None) -> Tensor:
    return h if mask is None else h * mask


def _input_gates(d: Tensor, size: int) -> Tensor:
    """Columns r, z, a of derivatives whose columns are r, z, c, a."""
    return torch.cat((d[..., : 2 * size], d[..., 3 * size :]), dim=-1)


def _gate_derivatives(
    grad: Tensor, hidden: Tensor, h: Tensor, gates: Tensor, c: Tensor, mask: Tensor | None
) -> Tensor:
    """Derivatives (S, T, b, 4H) by r, z before the sigmoid, by c, and by a; grad is by the hidden states."""
    s, steps, b, size = grad.shape
    d = grad.new_empty(s, steps, b, 4 * size)
    back = hidden.transpose(1, 2)
    dh = grad[:, -1]
    for t in reversed(range(steps)):
        r, z, n = gates[:, t].chunk(3, dim=-1)
        dr, dz, dc, da = d[:, t].chunk(4, dim=-1)
        torch.mul(torch.addcmul(dh, dh, z, value=-1), 1 - n * n, out=da)
        torch.mul(da, r, out=dc)
        torch.mul(dc * c[:, t], 1 - r, out=dr)
        torch.mul((h[:, t] - n) * dh, z - z * z, out=dz)
        if t:
            carried, of_gates = torch.addcmul(grad[:, t - 1], dh, z), d[:, t, :, : 3 * size]
            if mask is None:
                dh = torch.baddbmm(carried, of_gates, back)
            else:  # the mask lies between the product and the sum
                dh = torch.addcmul(carried, torch.bmm(of_gates, back), mask)
    return d
