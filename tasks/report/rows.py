"""Rows of the report's tables. Rates are shares of 1, lengths m, joint movement rad, times s."""

from __future__ import annotations

from dataclasses import dataclass

from plancurate.tasks.study.statistics import Interval


@dataclass(frozen=True)
class Comparison:
    """A test against General: statistic (z or t), p, p adjusted for the table's tests, stars by the plain p."""

    statistic: float
    p: float
    holm_p: float
    stars: str


@dataclass(frozen=True)
class SuccessRow:
    """A selection over all policies and training seeds."""

    selector: str
    budget: int | None
    n: int
    successes: int
    rate: float
    wilson: Interval
    networks: Interval | None
    """By drawing trained networks again; None where a policy was trained with one seed only."""
    settled_rate: float
    against_general: Comparison | None
    published: float | None


@dataclass(frozen=True)
class PolicyRow:
    """A policy on a selection, over all training seeds."""

    selector: str
    budget: int | None
    policy: str
    n: int
    successes: int
    rate: float
    wilson: Interval
    against_general: Comparison | None
    published: float | None


@dataclass(frozen=True)
class DistanceRow:
    """A selection on the tests at one distance (cm) from the trained targets."""

    selector: str
    budget: int | None
    distance_cm: int
    n: int
    successes: int
    rate: float
    wilson: Interval
    published: float | None


@dataclass(frozen=True)
class Mean:
    """A mean over trials."""

    value: float
    interval: Interval
    against_general: Comparison | None
    published: float | None


@dataclass(frozen=True)
class QualityRow:
    """How a selection's rollouts went."""

    selector: str
    budget: int | None
    n: int
    final_distance: Mean
    path_length: Mean
    joint_movement: Mean


@dataclass(frozen=True)
class TimeRow:
    """How long one selection took, by stage and in all."""

    selector: str
    budget: int | None
    prepare: float
    base_policy: float
    rollouts: float
    cluster: float
    score: float
    select: float
    total: float
    published: float | None


@dataclass(frozen=True)
class CoverageRow:
    """What a selection keeps of the pool."""

    selector: str
    budget: int | None
    kept: int
    pool: int
    targets: int
    targets_without: int
    least_per_target: int
    median_per_target: float
    most_per_target: int
    distinct_kept: int
    planners: int
    goal_configurations: int
    shortest_way: float
    """Share of the kept that lead to the goal configuration of their target's shortest candidate."""
    share_of_steps: float


@dataclass(frozen=True)
class PlannerRow:
    """A planner's part in a selection."""

    selector: str
    budget: int | None
    planner: str
    kept: int
    share: float


@dataclass(frozen=True)
class AgreementRow:
    """A selection's gain over General, here and in the publication."""

    selector: str
    budget: int | None
    gain: float
    interval: Interval
    stars: str
    published_gain: float
    published_stars: str
    difference: float
    """Our gain less the published one."""
    difference_interval: Interval
    verdict: str
    """In plain words."""


@dataclass(frozen=True)
class BelowRandomRow:
    """A published selector that does worse than drawing as many at random, and what of its choice explains it."""

    selector: str
    budget: int
    rate: float
    random_rate: float
    targets_without: int
    shortest_way: float
    random_shortest_way: float
    words: str
