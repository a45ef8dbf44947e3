"""Small networks that selectors train for themselves."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn.utils import skip_init

from plancurate.tasks.learning.demonstrations import Float32Array

_BLOCK = 8192  # rows at once: hidden layers of that many stay in the cache


def perceptron(sizes: Sequence[int], rng: torch.Generator) -> nn.Sequential:
    """Fully connected layers of the given sizes, ReLU between them, drawn as torch.nn.Linear draws them."""
    layers: list[nn.Module] = []
    for inputs, outputs in pairwise(sizes):
        linear = skip_init(nn.Linear, inputs, outputs)  # type: ignore[no-untyped-call] # its own draw would use up torch's global generator
        for parameter in linear.parameters():
            nn.init.uniform_(parameter, -(inputs**-0.5), inputs**-0.5, generator=rng)
        layers += [linear, nn.ReLU()]
    return nn.Sequential(*layers[:-1])


def in_blocks(network: Callable[[Tensor], Tensor], rows: Float32Array) -> Float32Array:
    """Outputs (rows, o) of a network for inputs (rows, i), with little memory and no gradients."""
    with torch.no_grad():
        blocks = [network(block).numpy() for block in torch.split(torch.from_numpy(rows), _BLOCK)]
    return np.concatenate(blocks)


@contextmanager
def one_thread() -> Iterator[None]:
    """Train inside the with block on one thread: with small batches more threads wait for each other."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)
