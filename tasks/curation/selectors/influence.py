"""Influence of demonstrations on a policy's expected return, from per-sample gradients in factors.

For a linear layer with input h and derivative delta by its output, the gradient of one sample is the outer
product of the two. Each is projected on its own (the factored projection of LoGRA), so that gradients of all
parameters are never written out. With phi the projected gradient of log pi(a | s) and Phi those of the
training steps, the influence of a demonstration is g_J^T (Phi^T Phi + lambda I)^-1 phi(demonstration): CUPID's
first-order change of the expected return J when the demonstration weighs more, with TRAK's stand-in for the
Hessian of the loss.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, TypeVar

import numpy as np
import numpy.typing as npt
from scipy.linalg import cho_factor, cho_solve

from plancurate.tasks.learning.demonstrations import Float32Array, FloatArray, IntArray

Step = TypeVar("Step", bound=np.generic)
Output = Literal["loglik", "square"]
Aggregation = Literal["mean", "sum"]
Activation = Literal["tanh", "relu"]
Factors = list[tuple[Float32Array, Float32Array]]
"""For each layer delta (steps, q) and h (steps, p), projected; a step's gradient is the outer product of both."""

CHUNK = 8192
"""Steps whose hidden units are held at once."""
GRAM_STEPS = 100_000
"""Steps at most that Phi^T Phi is summed over: a hundred for each of its about thousand dimensions."""


@dataclass(frozen=True, eq=False)
class Network:
    """A perceptron, in standardised units."""

    layers: tuple[tuple[Float32Array, Float32Array], ...]
    """Weight (inputs, outputs) and bias (outputs,) of each layer."""
    activation: Activation = "tanh"
    """What each hidden unit does."""

    def inputs(self, x: Float32Array) -> list[Float32Array]:
        """What goes into each layer (steps, inputs) for observations x (steps, o), and last what comes out."""
        values = [x]
        for k, (weight, bias) in enumerate(self.layers):
            out = values[-1] @ weight
            out += bias
            if k + 1 < len(self.layers):
                self._bend(out)
            values.append(out)
        return values

    def _bend(self, x: Float32Array) -> None:
        if self.activation == "tanh":
            np.tanh(x, out=x)
        else:
            np.maximum(x, 0, out=x)

    def slope(self, h: Float32Array) -> Float32Array:
        """Derivative (steps, units) of hidden units by their input, given what comes out of them."""
        return 1 - h * h if self.activation == "tanh" else (h > 0).astype(np.float32)

    def act(self, x: Float32Array) -> Float32Array:
        """Actions (steps, n) for observations x (steps, o)."""
        return np.concatenate([self.inputs(part)[-1] for part in in_chunks(x)])


@dataclass(frozen=True, eq=False)
class Gradients:
    """Projected gradients of a network's output function by its parameters."""

    network: Network
    projections: tuple[tuple[Float32Array, Float32Array], ...]
    """For each layer those of delta (outputs, q) and of h with a one behind it for the bias (inputs + 1, p)."""
    output: Output
    """loglik: log N(a; mu, sigma^2 I). square: mean of mu^2 (as CUPID's release has it), blind to the action."""
    sigma: float

    def factors(self, observations: Float32Array, actions: Float32Array) -> Factors:
        """Factors of the steps' gradients, for observations (steps, o) and actions (steps, n)."""
        parts = [
            self._factors(*part) for part in zip(in_chunks(observations), in_chunks(actions), strict=True)
        ]
        return [
            (np.concatenate([part[k][0] for part in parts]), np.concatenate([part[k][1] for part in parts]))
            for k in range(len(self.network.layers))
        ]

    def _factors(self, observations: Float32Array, actions: Float32Array) -> Factors:
        *inputs, mu = self.network.inputs(observations)
        delta: Float32Array = (actions - mu) / np.float32(self.sigma**2)
        if self.output == "square":
            delta = 2 * mu / np.float32(mu.shape[1])
        found: Factors = []
        for k in reversed(range(len(inputs))):
            of_delta, of_h = self.projections[k]
            found.append((delta @ of_delta, inputs[k] @ of_h[:-1] + of_h[-1]))
            if k:
                delta = delta @ self.network.layers[k][0].T
                delta *= self.network.slope(inputs[k])
        return found[::-1]


def in_chunks(steps: npt.NDArray[Step]) -> Iterator[npt.NDArray[Step]]:
    """CHUNK steps after CHUNK steps, so that hidden units stay in the processor's cache; of none, one empty chunk."""
    return (steps[first : first + CHUNK] for first in range(0, max(len(steps), 1), CHUNK))


def draw_projections(
    network: Network, size: int | None, rng: np.random.Generator
) -> tuple[tuple[Float32Array, Float32Array], ...]:
    """Draw projections of each layer's delta and h to at most `size` dimensions; None leaves them as they are.

    Columns are orthogonal, so that `size` beyond a factor's own dimension only turns it and loses nothing.
    """
    shapes = [(weight.shape[1], weight.shape[0] + 1) for weight, _ in network.layers]
    return tuple((_orthogonal(q, size, rng), _orthogonal(p, size, rng)) for q, p in shapes)


def _orthogonal(dimension: int, size: int | None, rng: np.random.Generator) -> Float32Array:
    """A matrix (dimension, columns) that keeps squared lengths in the mean."""
    if size is None:
        return np.eye(dimension, dtype=np.float32)
    columns = min(size, dimension)
    q, _ = np.linalg.qr(rng.normal(size=(dimension, columns)))
    return np.asarray(q * np.sqrt(dimension / columns), dtype=np.float32)


def trajectory_gradients(
    factors: Factors, starts: IntArray, lengths: IntArray, aggregation: Aggregation
) -> FloatArray:
    """Gradients (trajectories, d) of whole trajectories: the mean (or sum) over their steps; zero without steps.

    The sum of outer products is a matrix product of the factors, so that no step's gradient is written out.
    """
    sums = np.empty((len(starts), sum(delta.shape[1] * h.shape[1] for delta, h in factors)))
    for row, (first, length) in enumerate(zip(starts, lengths, strict=True)):
        steps = slice(first, first + length)
        sums[row] = np.concatenate([(delta[steps].T @ h[steps]).ravel() for delta, h in factors])
    return sums if aggregation == "sum" else sums / np.maximum(lengths, 1)[:, None]


def gram(gradients: Gradients, observations: Float32Array, actions: Float32Array) -> FloatArray:
    """Phi^T Phi (d, d) over observations (steps, o) and actions (steps, n), or GRAM_STEPS of them spread evenly."""
    steps = len(observations)
    rows = np.linspace(0, steps - 1, min(steps, GRAM_STEPS)).astype(np.int64)
    total: FloatArray = np.zeros(())
    for part in in_chunks(rows):
        factors = gradients.factors(observations[part], actions[part])
        outer = [(delta[:, :, None] * h[:, None, :]).reshape(len(part), -1) for delta, h in factors]
        phi = np.concatenate(outer, axis=1)
        total = total + (phi.T @ phi)  # float32 within a chunk, float64 over all
    return np.asarray(total)


@dataclass(frozen=True, eq=False)
class Hessian:
    """Phi^T Phi + lambda I with lambda = ridge * trace / d, to be solved with."""

    gram: FloatArray
    """(d, d)."""
    ridge: float

    @cached_property
    def _factor(self) -> Any:
        d = len(self.gram)
        return cho_factor(self.gram + self.ridge * np.trace(self.gram) / d * np.eye(d))

    def solve(self, gradients: FloatArray) -> FloatArray:
        """H^-1 g (rows, d) of gradients (rows, d)."""
        return np.asarray(cho_solve(self._factor, gradients.T).T)

    def self_influence(self, gradients: FloatArray) -> FloatArray:
        """g^T H^-1 g (rows,) of gradients (rows, d): how much a demonstration moves the policy towards itself."""
        return np.asarray(np.einsum("rd,rd->r", gradients, self.solve(gradients)))
