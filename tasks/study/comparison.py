"""Two studies of one lake side by side: what was set up differently, and which results differ."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study.bootstrap import paired_difference, rate_interval
from plancurate.tasks.study.paired_trials import Tested, tested
from plancurate.tasks.study.rows import Cell, Row
from plancurate.tasks.study.statistics import Interval, Outcomes, Test, holm
from plancurate.tasks.study.studies import recorded_study
from plancurate.tasks.study.trial_results import Kind


@dataclass(frozen=True)
class FieldDifference:
    """A field of the configuration and its value in either study; None where it is null or not recorded."""

    field: str
    a: Any
    b: Any


@dataclass(frozen=True)
class RateDifference(Row):
    """Success of one selection in both studies over seeds and `policies`; 1 is 100 %.

    Only policies that both studies tried on the selection count, or a difference could be one of policies. Intervals
    and tests are bootstraps over seeds and test targets; a test that both studies made, at the same position, is drawn
    for both at once, so that their difference is paired. Difference above 0: b is better.
    """

    policies: tuple[str, ...]
    a: Outcomes
    a_interval: Interval
    b: Outcomes
    b_interval: Interval
    difference: float
    interval: Interval
    p: float
    p_holm: float
    """Adjusted for all rows of the comparison."""
    stars: str
    """By p_holm."""


@dataclass(frozen=True)
class StudyComparison:
    """Study b against study a, by their identifiers, on one kind of test."""

    a: str
    b: str
    kind: Kind
    fields: list[FieldDifference]
    results: list[RateDifference]
    only_a: list[Cell]
    only_b: list[Cell]

    @property
    def repeated(self) -> int:
        """Rows in which b's rate lies inside a's interval: nearly all where b repeats a with other seeds."""
        return sum(row.a_interval.low <= row.b.rate <= row.a_interval.high for row in self.results)


def compare_studies(lake: Lake, a: str, b: str, kind: Kind = "displaced") -> StudyComparison:
    """Compare two studies by their identifiers, a's best selection first; UnknownNameError for an unknown one."""
    setup_a, setup_b = recorded_setup(lake, a), recorded_setup(lake, b)
    tested_a, tested_b = tested(lake, a, b, kind)
    return StudyComparison(
        a=a,
        b=b,
        kind=kind,
        fields=field_differences(setup_a, setup_b),
        results=rate_differences(tested_a, tested_b),
        only_a=[key for key in tested_a.counts if key not in tested_b.counts],
        only_b=[key for key in tested_b.counts if key not in tested_a.counts],
    )


def recorded_setup(lake: Lake, study: str) -> dict[str, Any]:
    """A study's configuration and the versions it ran with, by field path."""
    record = recorded_study(lake, study)
    versions = {"package_version": record.package_version, "ompl_version": record.ompl_version}
    return flattened({**record.config, **versions})


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


def rate_differences(a: Tested, b: Tested) -> list[RateDifference]:
    """Differences b - a of the success rates of what both studies tested, a's best first; Holm over all."""
    shared = [
        (key, policies)
        for key, by_policy in a.counts.items()
        if (policies := tuple(policy for policy in by_policy if policy in b.counts.get(key, {})))
    ]
    differences = [paired_difference(b.draws(*one), a.draws(*one)) for one in shared]
    adjusted = holm([difference.test.p for difference in differences])
    rows = [
        RateDifference(
            *key,
            policies=policies,
            a=a.outcomes(key, policies),
            a_interval=rate_interval(a.draws(key, policies)),
            b=b.outcomes(key, policies),
            b_interval=rate_interval(b.draws(key, policies)),
            difference=b.outcomes(key, policies).rate - a.outcomes(key, policies).rate,
            interval=difference.interval(1.0),
            p=difference.test.p,
            p_holm=p_holm,
            stars=Test(difference.test.statistic, p_holm).stars,
        )
        for (key, policies), difference, p_holm in zip(shared, differences, adjusted, strict=True)
    ]
    return sorted(rows, key=lambda row: -row.a.rate)
