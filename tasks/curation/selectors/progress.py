"""How much progress a trajectory makes: the self-supervised score of SCIZOR.

Zhang et al.: SCIZOR: A Self-Supervised Approach to Data Curation for Large-Scale Imitation Learning, 2025.
A classifier guesses from two states how much time lies between them. Where it takes the motion of a window for
one of less time, there was less progress than usual.

Time is counted in units in which a usual motion takes USUAL_DURATION, as long as the demonstrations the method
was made for: in seconds all windows would be longer than most of a planner's motions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import cross_entropy, softmax

from plancurate.tasks.curation.pool import FloatArray
from plancurate.tasks.curation.selectors.base import IntArray
from plancurate.tasks.curation.selectors.networks import in_blocks, one_thread, perceptron
from plancurate.tasks.learning.demonstrations import Float32Array

USUAL_DURATION = 13.0
EDGES = (0.0, 0.5, 1.0, 2.0, 5.0)  # where the classes of elapsed time begin; the last one has no end
WINDOW = 2.0
RATE = 20.0  # steps a unit of time, of the data the method was made for: its scores are per step
DISCOUNT = 0.5  # what is left of the blame for a lack of progress one unit of time earlier
HIDDEN = (256, 256)
BATCH = 512
LEARNING_RATE = 1e-3
WEIGHT_DECAY = 1e-3


@dataclass(frozen=True, eq=False)
class Clocked:
    """Steps of all candidates with their times."""

    states: Float32Array
    """(steps, s), standardised."""
    starts: IntArray
    """(candidates,): first step of each candidate."""
    lengths: IntArray
    """(candidates,): steps of each candidate."""
    step: FloatArray
    """(candidates,): units of time from one step to the next."""

    @property
    def duration(self) -> FloatArray:
        """Units of time (candidates,) that each candidate takes."""
        return (self.lengths - 1) * self.step

    def at(self, candidate: IntArray, time: FloatArray) -> Float32Array:
        """States (k, s) of candidates (k,) at times (k,) within their durations, linear between two steps."""
        position = np.minimum(time / self.step[candidate], self.lengths[candidate] - 1)
        before = np.minimum(position.astype(np.int64), np.maximum(self.lengths[candidate] - 2, 0))
        after = np.minimum(before + 1, self.lengths[candidate] - 1)
        share = (position - before).astype(np.float32)[:, None]
        first = self.starts[candidate]
        return np.asarray(self.states[first + before] * (1 - share) + self.states[first + after] * share)


def units(lengths: IntArray, dt: FloatArray) -> FloatArray:
    """Units of time (candidates,) from one step to the next of candidates of `lengths` steps of `dt` s each."""
    usual = float(np.median((lengths - 1) * dt))
    return dt / max(usual, 1e-9) * USUAL_DURATION


def train_classifier(clocked: Clocked, steps: int, seed: int) -> torch.nn.Sequential:
    """Fit logits (b, 5) of the class of elapsed time to pairs (b, 3s) by `steps` steps of AdamW."""
    rng, torch_rng = np.random.default_rng(seed), torch.Generator().manual_seed(seed)
    network = perceptron((3 * clocked.states.shape[1], *HIDDEN, len(EDGES)), torch_rng)
    adam = torch.optim.AdamW(network.parameters(), weight_decay=WEIGHT_DECAY, fused=True)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        adam, LEARNING_RATE, total_steps=steps + 1, pct_start=0.1, cycle_momentum=False
    )
    with one_thread():
        for _ in range(steps):
            pairs, classes = drawn_pairs(clocked, BATCH, rng)
            adam.zero_grad()
            loss = cross_entropy(network(torch.from_numpy(pairs)), torch.from_numpy(classes))
            loss.backward()  # type: ignore[no-untyped-call]
            adam.step()
            schedule.step()
    return network


def drawn_pairs(clocked: Clocked, count: int, rng: np.random.Generator) -> tuple[Float32Array, IntArray]:
    """Pairs (count, 3s) of states and their classes (count,) of elapsed time.

    Every candidate is as likely, so that long detours do not set what is usual; then every class, every time in
    it and every beginning. A time longer than the motion is cut to it and counts as what it has become.
    """
    candidate = rng.integers(len(clocked.lengths), size=count)
    duration = clocked.duration[candidate]
    number = rng.integers(len(EDGES), size=count)
    low = np.asarray(EDGES)[number]
    high = np.append(EDGES, 0)[number + 1]
    high = np.where(number == len(EDGES) - 1, np.maximum(duration, low), high)
    elapsed = np.minimum(rng.uniform(low, high), duration)
    begin = rng.uniform(0, duration - elapsed)
    classes = np.searchsorted(EDGES, elapsed, side="right") - 1
    return pairs_of(clocked, candidate, begin, elapsed), classes.astype(np.int64)


def pairs_of(clocked: Clocked, candidate: IntArray, begin: FloatArray, elapsed: FloatArray) -> Float32Array:
    """The state at `begin`, that `elapsed` units of time later, and their difference, side by side (k, 3s)."""
    now = clocked.at(candidate, begin)
    then = clocked.at(candidate, begin + elapsed)
    return np.concatenate([now, then, then - now], axis=1)


def class_rank(elapsed: FloatArray) -> FloatArray:
    """Class of elapsed times up to WINDOW, linear between the middles of classes and not below 0."""
    number = np.searchsorted(EDGES, elapsed, side="right") - 1
    low, high = np.asarray(EDGES)[number], np.append(EDGES, np.inf)[number + 1]
    return np.asarray(np.clip(number + (elapsed - low) / (high - low) - 0.5, 0, len(EDGES) - 1))


def lacks(clocked: Clocked, network: torch.nn.Sequential) -> FloatArray:
    """Lack of progress (steps,) in the window that begins at each step: in classes, per step at RATE, in [0, 1]."""
    candidate = np.repeat(np.arange(len(clocked.lengths)), clocked.lengths)
    number = np.arange(len(candidate)) - clocked.starts[candidate]
    begin = number * clocked.step[candidate]
    elapsed = np.clip(clocked.duration[candidate] - begin, 0, WINDOW)
    ranks = torch.arange(len(EDGES), dtype=torch.float32)

    def guess(pairs: Tensor) -> Tensor:
        return softmax(network(pairs), dim=1) @ ranks

    guessed = in_blocks(guess, pairs_of(clocked, candidate, begin, elapsed))
    return np.asarray(np.clip((class_rank(elapsed) - guessed) / np.maximum(elapsed * RATE, 1), 0, 1))


def suboptimality(clocked: Clocked, lack: FloatArray) -> FloatArray:
    """Score (steps,) from lacks of progress (steps,); higher is worse.

    Each step gets the mean lack of the windows that cover it, the blame for later lacks, which fades with the
    time between, and half of the result is replaced by its mean over the trajectory.
    """
    from scipy.signal import lfilter  # half a second that nobody else needs

    spread = []
    for own, step in zip(np.split(lack, clocked.starts[1:]), clocked.step, strict=True):
        covering = covering_mean(own, max(1, round(WINDOW / step)))
        blamed = lfilter([1.0], [1.0, -(DISCOUNT**step)], covering[::-1])[::-1]
        spread.append((blamed + blamed.mean()) / 2)
    return np.concatenate(spread)


def covering_mean(lack: FloatArray, window: int) -> FloatArray:
    """Mean (m,) of each of lack (m,) and the up to `window` - 1 before it."""
    total = np.concatenate([[0.0], np.cumsum(lack)])
    last = np.arange(1, len(total))
    first = np.maximum(last - window, 0)
    return np.asarray((total[last] - total[first]) / (last - first))
