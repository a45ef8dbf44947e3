"""Bootstrap of success rates over all that a study drew: selection seeds, training seeds and test targets.

Selection seeds are drawn again, within each of them the training seeds of each policy, and test targets across all
networks; policies stay as they are. Each level draws one member fewer than it has (Rao and Wu, 1988), which gives
the variance its right size where there are few. A level with a single member shows no spread and adds none.

Two imagined test targets take part, or rates near 0 or 1 would seem certain (as in Agresti and Min, 2005): for one
selection, one that all its networks reach and one that none does; for a difference, one that only this selection
reaches and one that only the other does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from plancurate.tasks.study.statistics import CONFIDENCE, Estimate, Interval

DRAWS = 10_000
IMAGINED = 2

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]
TargetCounts = npt.NDArray[np.float32]
"""Whole numbers: below 2^24 they are exact in single precision, in which products take half the time."""
Weights = npt.NDArray[np.float32]
Counts = FloatArray
"""(1 + draws, 3): successes with the first imagined target reached, with the second, trials; row 0 as it is."""


@dataclass(frozen=True, eq=False)
class Grid:
    """Trials of one selection's networks at a common list of test targets."""

    success: BoolArray
    """(networks, targets)."""
    tried: BoolArray
    """(networks, targets): False where a network was not tested."""
    policies: tuple[str, ...]
    """Of each network, as the next two."""
    selection_seeds: tuple[int, ...]
    seeds: tuple[int, ...]


def target_counts(n_targets: int, rng: np.random.Generator, draws: int = DRAWS) -> TargetCounts:
    """How often each test target is drawn (1 + draws, n_targets + 2), the imagined ones last; row 0: once each."""
    members = n_targets + IMAGINED
    counts = np.ones((1 + draws, members), np.float32)
    counts[1:] = _drawn(rng, members, np.ones(draws, np.int64))
    return counts


def network_weights(grid: Grid, rng: np.random.Generator, draws: int = DRAWS) -> Weights:
    """How much each network counts in each draw (1 + draws, networks), on average 1; row 0: once each."""
    weights = np.ones((1 + draws, len(grid.policies)), np.float32)
    chosen, policies = np.array(grid.selection_seeds), np.array(grid.policies)
    known = np.unique(chosen)
    copies = _drawn(rng, len(known), np.ones(draws, np.int64))
    for seed, times in zip(known, copies.T, strict=True):
        for policy in np.unique(policies):
            own = np.flatnonzero((chosen == seed) & (policies == policy))
            if len(own):
                drawn = _drawn(rng, len(own), times)
                weights[1:, own] = drawn * (_enlarged(len(own)) * _enlarged(len(known)))
    return weights


def drawn_counts(grid: Grid, targets: TargetCounts, weights: Weights) -> dict[str, Counts]:
    """Successes and trials of each policy in each draw, for drawn targets and weights of networks."""
    reached = _times_drawn(targets, grid.success)
    tried = _times_drawn(targets, grid.tried)
    size = np.full(len(targets), _enlarged(targets.shape[1]))
    size[0] = 1.0
    counts = {}
    for policy in dict.fromkeys(grid.policies):
        own = [i for i, name in enumerate(grid.policies) if name == policy]
        networks = weights[:, own].astype(np.float64)
        imagined = networks.sum(axis=1)[:, None] * targets[:, -IMAGINED:]
        successes = (networks * reached[:, own]).sum(axis=1)
        trials = (networks * tried[:, own]).sum(axis=1) + imagined.sum(axis=1)
        columns = [successes + imagined[:, 0], successes + imagined[:, 1], trials]
        counts[policy] = np.stack(columns, axis=1) * size[:, None]
    return counts


def pooled(counts: Mapping[str, Counts]) -> Counts:
    """All policies together."""
    return np.sum(list(counts.values()), axis=0)  # type: ignore[no-any-return]


def rate_interval(counts: Counts, confidence: float = CONFIDENCE) -> Interval:
    """Percentile interval of a success rate."""
    rates = _rates(counts, 0)[1:]
    low, high = np.nanquantile(rates, [(1 - confidence) / 2, (1 + confidence) / 2])
    return Interval(float(low), float(high))


def paired_difference(counts: Counts, base: Counts) -> Estimate:
    """A success rate less a base's on the same draws of test targets, with the spread of the draws as its error.

    The imagined targets draw the value towards 0; the error is never 0.
    """
    differences = _rates(counts, 0) - _rates(base, 1)
    return Estimate(float(differences[0]), float(np.nanstd(differences[1:], ddof=1)))


def varied(grid: Grid) -> str:
    """What an interval takes in, in words, such as 'training seeds and targets' or 'targets only'."""
    levels = []
    if len(set(grid.selection_seeds)) > 1:
        levels.append("selection seeds")
    if len(set(grid.seeds)) > 1:
        levels.append("training seeds")
    return " and ".join([", ".join(levels), "targets"]) if levels else "targets only"


def _drawn(rng: np.random.Generator, members: int, times: IntArray) -> IntArray:
    """How often each member is drawn (draws, members) when one fewer than all are drawn `times` times over."""
    if members == 1:  # always, and without chance
        return times[:, None]
    return rng.multinomial(times * max(members - 1, 1), np.full(members, 1 / members))


def _times_drawn(targets: TargetCounts, cells: BoolArray) -> TargetCounts:
    """How many of each network's cells (networks, targets) that are true were drawn (1 + draws, networks)."""
    if cells.all():
        return np.repeat(targets[:, :-IMAGINED].sum(axis=1, keepdims=True), len(cells), axis=1)
    return targets[:, :-IMAGINED] @ cells.T.astype(np.float32)


def _enlarged(members: int) -> float:
    """What makes up for drawing one fewer."""
    return members / max(members - 1, 1)


def _rates(counts: Counts, imagined: int) -> FloatArray:
    """Success rates (1 + draws,); NaN where a draw has none of the policy's networks."""
    rates = np.full(len(counts), np.nan)
    np.divide(counts[:, imagined], counts[:, 2], out=rates, where=counts[:, 2] > 0)
    return rates
