"""What the publication printed (Appl. Sci. 2026, 16(6), 2968), for tables side by side with our own."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from types import MappingProxyType
from typing import Any

import yaml

from plancurate.tasks.curation.names import unlabelled
from plancurate.tasks.study.statistics import Interval, Outcomes


@dataclass(frozen=True)
class PublishedResult:
    """A selector in tables A1 to A5; successes are the whole numbers behind the printed percentages.

    Totals over `by_distance` differ from `success` for some selectors: so they do in print.
    """

    selector: str
    success: Outcomes
    """A1: four policies, 320 trials."""
    by_policy: Mapping[str, Outcomes]
    """A2: 80 trials a policy, by this project's names of the policies."""
    by_distance: Mapping[int, Outcomes]
    """A3: distance of the tested from the trained target in cm; 20 trials at 0 cm, 60 at each other."""
    final_distance: float
    """A4, m."""
    path_length: float
    """A4, m."""
    joint_movement: float
    """A4, rad."""
    selection_time_s: float
    """A5, s."""
    selection_times: int
    """A5: how many selections were timed."""
    selection_time_interval: Interval | None
    """A5, s; None where it is not known."""


@cache
def published_results() -> Mapping[str, PublishedResult]:
    """Every published selector by name, best success rate first."""
    text = files(__package__).joinpath("published.yaml").read_text(encoding="utf-8")
    tables = yaml.safe_load(text)
    return MappingProxyType({name: _result(name, row, tables) for name, row in tables["selectors"].items()})


def published_for(selectors: Iterable[str]) -> dict[str, PublishedResult]:
    """Results by the names of a study's selectors, whatever parameters these were given; only of published ones."""
    known = published_results()
    return {name: known[unlabelled(name)] for name in selectors if unlabelled(name) in known}


def _result(selector: str, row: Mapping[str, Any], tables: Mapping[str, Any]) -> PublishedResult:
    per_policy, per_distance = tables["trials_by_policy"], tables["trials_by_distance"]
    policies, distances = tables["policies"], tables["distances_cm"]
    return PublishedResult(
        selector=selector,
        success=_outcomes(row["success"], per_policy * len(policies)),
        by_policy=MappingProxyType(
            {
                policy: _outcomes(percent, per_policy)
                for policy, percent in zip(policies, row["by_policy"], strict=True)
            }
        ),
        by_distance=MappingProxyType(
            {
                distance: _outcomes(percent, n)
                for distance, percent, n in zip(distances, row["by_distance"], per_distance, strict=True)
            }
        ),
        **{
            name: row[name]
            for name in ("final_distance", "path_length", "joint_movement", "selection_time_s")
        },
        selection_times=tables["selection_times"],
        selection_time_interval=Interval(*row["selection_time_interval"])
        if "selection_time_interval" in row
        else None,
    )


def _outcomes(percent: float, n: int) -> Outcomes:
    """The count behind a printed percentage: with n < 500, one decimal leaves a single whole number."""
    return Outcomes(round(percent / 100 * n), n)
