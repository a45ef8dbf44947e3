"""Rows about a study's selections and pools, and about how far they agree with the publication."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from plancurate.tasks.study.rows import Row
from plancurate.tasks.study.statistics import Interval


@dataclass(frozen=True)
class TimeRow(Row):
    """How long a selection took, by stage and in all: means over selection seeds."""

    n: int
    seconds: Mapping[str, float]
    """By stage."""
    total: float
    interval: Interval | None
    """Student's; None for a single selection."""
    published: float | None
    published_n: int | None
    published_interval: Interval | None


@dataclass(frozen=True)
class CoverageRow(Row):
    """What a selection keeps of the pool, on average over selection seeds."""

    selections: int
    kept: float
    pool: int
    targets: int
    targets_without: float
    least_per_target: int
    median_per_target: float
    most_per_target: int
    distinct_kept: float
    planners: float
    goal_configurations: float
    shortest_way: float
    """Share of the kept that lead to the goal configuration of their target's shortest candidate."""
    share_of_steps: float


@dataclass(frozen=True)
class PlannerRow(Row):
    """A planner's part in a selection."""

    planner: str
    kept: int
    share: float


@dataclass(frozen=True)
class RankingRow(Row):
    """How stably a selector's scores rank candidates, where they are estimated from rollouts."""

    selections: int
    split_half: float
    """Spearman's correlation of the scores from two halves of the rollouts, mean over selection seeds."""
    least: float
    """Likewise, of the selection seed with the lowest."""

    @property
    def unsteady(self) -> bool:
        """Whether so much of the order is chance that other rollouts would keep other candidates."""
        return self.split_half < 0.5


@dataclass(frozen=True)
class PoolRow:
    """What a study's candidates of one pool are worth."""

    scene: str
    pool_label: str
    targets: int
    """That have a candidate."""
    candidates: int
    distinct: int
    degenerate: bool
    """Whether fewer than a third of the candidates differ."""
    goal_classes: float | None
    """Mean number of classes of goal configurations a target; None while nothing is labelled."""
    ways: float | None
    """Mean number of ways a target: goal class and path class."""

    @property
    def distinct_share(self) -> float:
        """Share of the candidates that differ."""
        return self.distinct / self.candidates

    @property
    def distinct_a_target(self) -> float:
        """Mean number of distinct candidates a target."""
        return self.distinct / self.targets


@dataclass(frozen=True)
class AgreementRow(Row):
    """A selection's gain over General, here and in the publication."""

    gain: float
    interval: Interval
    p: float
    published_gain: float
    published_p: float
    difference: float
    """Our gain less the published one."""
    difference_interval: Interval
    verdict: str
    """In plain words."""


@dataclass(frozen=True)
class BelowRandomRow(Row):
    """A published selector that does worse than drawing as many at random, and what of its choice explains it."""

    success_rate: float
    random_rate: float
    targets_without: float
    shortest_way: float
    random_shortest_way: float
    words: str
