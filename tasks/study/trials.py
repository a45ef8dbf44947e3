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
    TargetCounts,
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


class Bootstrap:
    """Draws of a study's networks and test targets: the networks' once, whatever is asked about them."""

    def __init__(self, networks: Sequence[NetworkTrials], seed: int = 0, draws: int = DRAWS) -> None:
        self._by_cell: dict[Cell, list[NetworkTrials]] = defaultdict(list)
        for network in networks:
            self._by_cell[network.cell].append(network)
        self._seed, self._draws = seed, draws
        self._weights = {
            cell: network_weights(_grid(own, _tests(own)), _generator(seed, *map(str, cell)), draws)
            for cell, own in self._by_cell.items()
        }
        self._targets: dict[tuple[int, str, str], TargetCounts] = {}

    def draw(self, measure: Measure = "success", distance_cm: int | None = None) -> dict[Cell, Drawn]:
        """Draws of each selection in each scene, and over all scenes for one that none of several lacks.

        Within a scene all selections see the same drawn test targets, so that differences are paired. With a distance
        only tests at that distance from the trained targets count.
        """
        drawn: dict[Cell, Drawn] = {}
        groups = list(dict.fromkeys((cell.scene, cell.pool_label) for cell in self._by_cell))
        for scene, pool_label in groups:
            chosen = {
                cell: [n if distance_cm is None else n.at_distance(distance_cm) for n in own]
                for cell, own in self._by_cell.items()
                if (cell.scene, cell.pool_label) == (scene, pool_label)
            }
            tests = _tests([network for own in chosen.values() for network in own])
            targets = self._target_counts(len(tests), scene, pool_label)
            for cell, own in chosen.items():
                grid = _grid(own, tests, measure)
                drawn[cell] = Drawn(drawn_counts(grid, targets, self._weights[cell]), varied(grid))
        return drawn | _totals(drawn, groups)

    def _target_counts(self, n_targets: int, scene: str, pool_label: str) -> TargetCounts:
        """Drawn test targets of a scene: each measure and distance with as many sees the same."""
        key = n_targets, scene, pool_label
        if key not in self._targets:
            self._targets[key] = target_counts(
                n_targets, _generator(self._seed, scene, pool_label), self._draws
            )
        return self._targets[key]

    def by_distance(self) -> dict[tuple[Cell, int], Counts]:
        """Draws of each selection at each distance of the tested from the trained target, all policies together."""
        known = [np.unique(network.distances_cm) for own in self._by_cell.values() for network in own]
        distances = sorted({int(cm) for some in known for cm in some if cm >= 0})
        return {
            (cell, distance): drawn.counts
            for distance in distances
            for cell, drawn in self.draw(distance_cm=distance).items()
        }


def _totals(drawn: Mapping[Cell, Drawn], groups: Sequence[tuple[str, str]]) -> dict[Cell, Drawn]:
    totals = {}
    for cell in drawn:
        scenes = [scene for scene, pool_label in groups if pool_label == cell.pool_label]
        parts = [drawn.get(cell._replace(scene=scene)) for scene in scenes]
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


def _tests(networks: Sequence[NetworkTrials]) -> IntArray:
    return np.unique(np.concatenate([network.test_ids for network in networks]))


def _grid(networks: Sequence[NetworkTrials], tests: IntArray, measure: Measure = "success") -> Grid:
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
