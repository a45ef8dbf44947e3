"""Trials of a study by network, and what bootstrap draws of them give for each selection."""

from __future__ import annotations

import zlib
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import pyarrow as pa

from plancurate.tasks.study.bootstrap import (
    DRAWS,
    BoolArray,
    Counts,
    Grid,
    IntArray,
    drawn_counts,
    network_weights,
    pooled,
    target_counts,
    varied,
)
from plancurate.tasks.study.rows import ALL_SCENES, Cell

Measure = Literal["success", "settled"]


@dataclass(frozen=True, eq=False)
class NetworkTrials:
    """How one network did at its test targets, in order of their number."""

    cell: Cell
    policy: str
    selection_seed: int
    seed: int
    test_ids: IntArray
    success: BoolArray
    settled: BoolArray
    distances_cm: IntArray
    """From the trained target; -1 for a fresh one."""

    def at_distance(self, distance_cm: int) -> NetworkTrials:
        """The trials at one distance from the trained targets."""
        there = self.distances_cm == distance_cm
        lists = ("test_ids", "success", "settled", "distances_cm")
        return replace(self, **{name: getattr(self, name)[there] for name in lists})


@dataclass(frozen=True, eq=False)
class Drawn:
    """Bootstrap draws of one selection in one scene, or in all."""

    by_policy: Mapping[str, Counts]
    over: str
    """What was drawn again, in words."""

    @property
    def counts(self) -> Counts:
        """All policies together."""
        return pooled(self.by_policy)


def network_trials(rows: pa.Table) -> list[NetworkTrials]:
    """Rows of results/outcomes as arrays."""
    plain = rows.drop_columns(["test_ids", "success", "settled", "distances_cm"]).to_pylist()
    lists = [_arrays(rows[name]) for name in ("test_ids", "success", "settled", "distances_cm")]
    return [
        NetworkTrials(
            Cell(row["scene"], row["pool_label"], row["selector"], row["budget"]),
            row["policy"],
            row["selection_seed"],
            row["seed"],
            *arrays,
        )
        for row, *arrays in zip(plain, *lists, strict=True)
    ]


def draw(
    networks: Sequence[NetworkTrials], measure: Measure = "success", seed: int = 0, draws: int = DRAWS
) -> dict[Cell, Drawn]:
    """Draws of each selection in each scene, and over all scenes for one that none of several lacks.

    Within a scene all selections see the same drawn test targets, so that differences are paired.
    """
    found: dict[Cell, Drawn] = {}
    by_scene: dict[tuple[str, str], dict[Cell, list[NetworkTrials]]] = defaultdict(lambda: defaultdict(list))
    for network in networks:
        by_scene[network.cell.scene, network.cell.pool_label][network.cell].append(network)
    for (scene, pool_label), selections in by_scene.items():
        tests = np.unique(np.concatenate([n.test_ids for own in selections.values() for n in own]))
        targets = target_counts(len(tests), _generator(seed, scene, pool_label), draws)
        for cell, own in selections.items():
            grid = _grid(own, tests, measure)
            weights = network_weights(grid, _generator(seed, *map(str, cell)), draws)
            found[cell] = Drawn(drawn_counts(grid, targets, weights), varied([grid]))
    return found | _totals(found, list(by_scene))


def draw_by_distance(networks: Sequence[NetworkTrials], seed: int = 0) -> dict[tuple[Cell, int], Counts]:
    """Draws of each selection at each distance of the tested from the trained target, all policies together."""
    known = [np.unique(network.distances_cm) for network in networks]
    distances = sorted({int(cm) for found in known for cm in found if cm >= 0})
    return {
        (cell, distance): drawn.counts
        for distance in distances
        for cell, drawn in draw([n.at_distance(distance) for n in networks], seed=seed).items()
    }


def _totals(found: Mapping[Cell, Drawn], groups: Sequence[tuple[str, str]]) -> dict[Cell, Drawn]:
    totals = {}
    for cell in found:
        scenes = [scene for scene, pool_label in groups if pool_label == cell.pool_label]
        parts = [found.get(cell._replace(scene=scene)) for scene in scenes]
        complete = [part for part in parts if part is not None]
        if len(scenes) > 1 and len(complete) == len(scenes):
            totals[cell._replace(scene=ALL_SCENES)] = _summed(complete)
    return totals


def _summed(parts: Sequence[Drawn]) -> Drawn:
    policies = dict.fromkeys(policy for part in parts for policy in part.by_policy)
    by_policy = {
        policy: pooled({str(i): p.by_policy[policy] for i, p in enumerate(parts) if policy in p.by_policy})
        for policy in policies
    }
    return Drawn(by_policy, max((part.over for part in parts), key=len))  # the longest names the most levels


def _grid(networks: Sequence[NetworkTrials], tests: IntArray, measure: Measure) -> Grid:
    success, tried = (np.zeros((len(networks), len(tests)), dtype=np.bool_) for _ in range(2))
    for i, network in enumerate(networks):
        columns = np.searchsorted(tests, network.test_ids)
        success[i, columns] = getattr(network, measure)
        tried[i, columns] = True
    return Grid(
        success,
        tried,
        tuple(network.policy for network in networks),
        tuple(network.selection_seed for network in networks),
        tuple(network.seed for network in networks),
    )


def _generator(seed: int, *names: str) -> np.random.Generator:
    """Random numbers that depend on what they are for, not on what else is drawn."""
    return np.random.default_rng([seed, zlib.crc32("/".join(names).encode())])


def _arrays(column: pa.ChunkedArray) -> list[np.ndarray]:
    return [scalar.values.to_numpy(zero_copy_only=False) for scalar in column]
