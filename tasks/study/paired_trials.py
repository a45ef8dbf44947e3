"""Trials of two studies with the tests that both made drawn for both at once, so that differences are paired."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study.against import cell
from plancurate.tasks.study.bootstrap import Counts, IntArray, pooled
from plancurate.tasks.study.rows import Cell
from plancurate.tasks.study.statistics import Outcomes
from plancurate.tasks.study.trial_results import Kind
from plancurate.tasks.study.trials import Bootstrap, Drawn, NetworkTrials, network_trials

Place = tuple[str, str, float, float, float, int]
"""Of a test: scene, pool label, position in m, and how many tests before it lie there."""


@dataclass(frozen=True, eq=False)
class Tested:
    """Success of a study by selection and policy: counts and bootstrap draws."""

    counts: Mapping[Cell, Mapping[str, Outcomes]]
    drawn: Mapping[Cell, Drawn]

    def outcomes(self, key: Cell, policies: Sequence[str]) -> Outcomes:
        """All trials of some policies on a selection."""
        parts = [self.counts[key][policy] for policy in policies]
        return Outcomes(sum(part.successes for part in parts), sum(part.n for part in parts))

    def draws(self, key: Cell, policies: Sequence[str]) -> Counts:
        """Draws of some policies on a selection."""
        return pooled({policy: self.drawn[key].by_policy[policy] for policy in policies})


def tested(lake: Lake, a: str, b: str, kind: Kind) -> tuple[Tested, Tested]:
    """Success of two studies by selection and policy, the tests that both made drawn for both at once.

    Without what goes over all scenes where they tested other scenes.
    """
    numbers: dict[Place, int] = {}
    trials = [
        marked(one, side)
        for side, study in (("a", a), ("b", b))
        for one in numbered_trials(lake, study, kind, numbers)
    ]
    drawn = Bootstrap(trials).draw()
    return tested_of(lake, a, kind, of_side(drawn, "a")), tested_of(lake, b, kind, of_side(drawn, "b"))


def marked(trials: NetworkTrials, side: str) -> NetworkTrials:
    """Trials under a selector of their study's own: each study's networks are drawn apart, their tests together."""
    return replace(trials, cell=trials.cell._replace(selector=side + trials.cell.selector))


def numbered_trials(lake: Lake, study: str, kind: Kind, numbers: dict[Place, int]) -> list[NetworkTrials]:
    """A study's trials with their tests numbered by place, as in `numbers`, where new places are added."""
    met: Counter[tuple[Any, ...]] = Counter()
    of_test = {}
    for row in lake.query("results/tests", study=study, kind=kind).to_pylist():
        where = tuple(row[name] for name in ("scene", "pool_label", "x", "y", "z"))
        of_test[where[:2], row["test_id"]] = numbers.setdefault((*where, met[where]), len(numbers))
        met[where] += 1
    return [
        in_order_of_number(one, np.array([of_test[one.cell[:2], test] for test in one.test_ids.tolist()]))
        for one in network_trials(lake.query("results/outcomes", study=study, kind=kind))
    ]


def in_order_of_number(trials: NetworkTrials, numbers: IntArray) -> NetworkTrials:
    """Trials in the order of their tests' numbers, which become their ids."""
    order = np.argsort(numbers)
    lists = {name: getattr(trials, name)[order] for name in ("success", "settled", "distances_cm")}
    return replace(trials, test_ids=numbers[order], **lists)


def of_side(drawn: Mapping[Cell, Drawn], side: str) -> dict[Cell, Drawn]:
    """What was drawn for one study, under its own selectors again."""
    return {
        key._replace(selector=key.selector[1:]): one for key, one in drawn.items() if key.selector[0] == side
    }


def tested_of(lake: Lake, study: str, kind: Kind, drawn: Mapping[Cell, Drawn]) -> Tested:
    """Draws of a study's selections with their successes and trials by policy."""
    counts: dict[Cell, dict[str, Outcomes]] = {}
    for row in lake.query("results/by_policy", study=study, kind=kind).to_pylist():
        if cell(row) in drawn:
            counts.setdefault(cell(row), {})[row["policy"]] = Outcomes(row["successes"], row["n"])
    return Tested(counts, drawn)
