"""Two studies of one lake side by side: what was set up differently, and which results differ."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from plancurate.tasks.lake import Lake
from plancurate.tasks.study.results import find_study
from plancurate.tasks.study.statistics import Interval, Outcomes, Test, holm, rate_difference, wilson_interval

Selection = tuple[str, int | None]
"""Selector and budget (None: it has none)."""
Counts = Mapping[str, Outcomes]
"""Successes by policy."""


@dataclass(frozen=True)
class FieldDifference:
    """A field of the configuration and its value in either study; None where it is null or not recorded."""

    field: str
    a: Any
    b: Any


@dataclass(frozen=True)
class RateDifference:
    """Success of one selection in both studies over training seeds and `policies`; 1 is 100 %.

    Only policies that both studies tried on the selection count, or a difference could be one of policies.
    z and p are of the pooled two-proportion test, z > 0: b is better. p_holm is adjusted for all rows of
    the comparison, and the stars go by it. Every trial counts as independent, even one of a network that
    both studies have.
    """

    selector: str
    budget: int | None
    policies: tuple[str, ...]
    a: Outcomes
    a_interval: Interval
    b: Outcomes
    b_interval: Interval
    difference: float
    interval: Interval
    z: float
    p: float
    p_holm: float

    @property
    def stars(self) -> str:
        """Stars of the adjusted p value."""
        return Test(self.z, self.p_holm).stars


@dataclass(frozen=True)
class StudyComparison:
    """Study b against study a, by the names that `evaluations` calls them, on one kind of test."""

    a: str
    b: str
    kind: str
    fields: list[FieldDifference]
    results: list[RateDifference]
    only_a: list[Selection]
    only_b: list[Selection]


def compare_studies(lake: Lake, a: str, b: str, kind: str = "displaced") -> StudyComparison:
    """Compare two studies of full or plain names (the latest of several), a's best selection first.

    kind of test: displaced or unseen. UnknownNameError for a study without trials.
    """
    name_a, name_b = find_study(lake, a), find_study(lake, b)
    counts_a, counts_b = policy_counts(lake, name_a, kind), policy_counts(lake, name_b, kind)
    return StudyComparison(
        a=name_a,
        b=name_b,
        kind=kind,
        fields=field_differences(recorded_setup(lake, name_a), recorded_setup(lake, name_b)),
        results=rate_differences(counts_a, counts_b),
        only_a=[selection for selection in counts_a if selection not in counts_b],
        only_b=[selection for selection in counts_b if selection not in counts_a],
    )


def recorded_setup(lake: Lake, study: str) -> dict[str, Any]:
    """A study's configuration and the versions it ran with, by field path; empty where none is recorded."""
    rows = lake.query("results/study", study=study).to_pylist()
    versions = ("package_version", "ompl_version")
    return {
        field: value
        for row in rows
        for field, value in flattened({**json.loads(row["config"]), **{v: row[v] for v in versions}}).items()
    }


def flattened(values: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested mappings as one of paths such as `candidates.timing.dt`; lists stay whole."""
    result: dict[str, Any] = {}
    for name, value in values.items():
        path = f"{prefix}{name}"
        result |= flattened(value, f"{path}.") if isinstance(value, Mapping) else {path: value}
    return result


def field_differences(a: Mapping[str, Any], b: Mapping[str, Any]) -> list[FieldDifference]:
    """Fields whose values differ, in a's order, then those that only b has."""
    return [
        FieldDifference(field, a.get(field), b.get(field))
        for field in {**a, **b}
        if a.get(field) != b.get(field)
    ]


def policy_counts(lake: Lake, study: str, kind: str) -> dict[Selection, dict[str, Outcomes]]:
    """Successes of a study over training seeds, of each selection by policy."""
    counts: dict[Selection, dict[str, Outcomes]] = {}
    for row in lake.query("results/by_policy_total", study=study, kind=kind).to_pylist():
        by_policy = counts.setdefault((row["selector"], row["budget"]), {})
        by_policy[row["policy"]] = Outcomes(row["successes"], row["n"])
    return counts


def rate_differences(a: Mapping[Selection, Counts], b: Mapping[Selection, Counts]) -> list[RateDifference]:
    """Differences b - a of the success rates of what both studies tested, a's best first; Holm over all."""
    found = []
    for selection, by_policy in a.items():
        policies = tuple(policy for policy in by_policy if policy in b.get(selection, {}))
        if policies:
            pooled_a, pooled_b = (pooled(counts[selection], policies) for counts in (a, b))
            found.append((selection, policies, pooled_a, pooled_b, rate_difference(pooled_b, pooled_a)))
    adjusted = holm([difference.test.p for *_, difference in found])
    rows = [
        RateDifference(
            selector=selector,
            budget=budget,
            policies=policies,
            a=pooled_a,
            a_interval=wilson_interval(pooled_a.successes, pooled_a.n),
            b=pooled_b,
            b_interval=wilson_interval(pooled_b.successes, pooled_b.n),
            difference=difference.value,
            interval=difference.interval,
            z=difference.test.statistic,
            p=difference.test.p,
            p_holm=p_holm,
        )
        for ((selector, budget), policies, pooled_a, pooled_b, difference), p_holm in zip(
            found, adjusted, strict=True
        )
    ]
    return sorted(rows, key=lambda row: -row.a.rate)


def pooled(by_policy: Counts, policies: Sequence[str]) -> Outcomes:
    """All trials of these policies together."""
    parts = [by_policy[policy] for policy in policies]
    return Outcomes(sum(part.successes for part in parts), sum(part.n for part in parts))
