"""Rows of a study's results. Rates are shares of 1, lengths m, joint movement rad, times s.

Every row is about one scene, or all of several, and one variant of its candidates (pool_label, empty where a study
has one). Where the publication has a number for the same thing, `published` holds it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

from plancurate.tasks.curation.selectors.selection import label
from plancurate.tasks.study.statistics import Interval

ALL_SCENES = "all scenes"
"""Scene of the rows that go over all of several scenes; no scene can have this name."""
REPORT_FIELDS = (
    "scene", "pool_label", "selector", "budget", "policy", "seed", "selection_seed", "n", "successes", "success_rate",
    "ci_low", "ci_high", "settled_rate", "final_distance", "path_length", "joint_movement", "selection_time_s",
    "n_kept",
)  # fmt: skip


class Cell(NamedTuple):
    """A selection in a scene."""

    scene: str
    pool_label: str
    selector: str
    budget: int | None
    """Trajectories a target; None where the selector has no budget."""


@dataclass(frozen=True)
class Row:
    """What a row is about."""

    scene: str
    pool_label: str
    selector: str
    budget: int | None

    @property
    def cell(self) -> Cell:
        """The selection and where."""
        return Cell(self.scene, self.pool_label, self.selector, self.budget)

    @property
    def group(self) -> tuple[str, str]:
        """Scene and pool label: rows of a group are compared with each other."""
        return self.scene, self.pool_label

    @property
    def name(self) -> str:
        """Selector and budget for a person."""
        return label(self.selector, self.budget)


@dataclass(frozen=True)
class PlainTest:
    """A test of the publication's kind, which takes all trials for independent: z or t; stars by the plain p."""

    statistic: float
    p: float
    stars: str


@dataclass(frozen=True)
class Gain:
    """Success less General's, on the same test targets: bootstrap interval and test, stars by Holm's p."""

    value: float
    error: float
    """Standard error."""
    interval: Interval
    p: float
    holm_p: float
    """Adjusted for all rows of the same kind and scene."""
    stars: str
    z_test: PlainTest
    """The publication's: pooled z-test of two proportions."""


@dataclass(frozen=True)
class ResultRow(Row):
    """A policy trained on one selection with one seed; Wilson's intervals."""

    policy: str
    seed: int
    selection_seed: int
    n: int
    successes: int
    success_rate: float
    ci_low: float
    ci_high: float
    settled_rate: float
    settled_ci_low: float
    settled_ci_high: float
    final_distance: float
    path_length: float
    joint_movement: float
    selection_time_s: float
    n_kept: int

    def report(self) -> dict[str, Any]:
        """The fields of the printed table, in its order."""
        values = asdict(self)
        return {name: values[name] for name in REPORT_FIELDS}


@dataclass(frozen=True)
class SummaryRow(Row):
    """A selection over all policies and seeds."""

    n: int
    successes: int
    success_rate: float
    interval: Interval
    interval_over: str
    """What the bootstrap drew again, such as 'targets only'."""
    wilson: Interval
    """The publication's interval."""
    settled_rate: float
    settled_interval: Interval
    hard_n: int
    """Trials of the hard subset: the straight joint line to the nearest goal is not free."""
    hard_successes: int
    tests: int
    """Different test targets."""
    selection_seeds: int
    training_seeds: int
    final_distance: float
    path_length: float
    joint_movement: float
    selection_time_s: float
    n_kept: float
    gain: Gain | None
    """None for General and where it is missing."""
    published: float | None
    rank: int
    """1 plus the number of selections of the group with a higher rate."""
    best: bool
    """Whether it is the first of its group, or not significantly below it (Holm over the group)."""

    @property
    def hard_rate(self) -> float | None:
        """Success on the hard subset; None where no trial is of it."""
        return self.hard_successes / self.hard_n if self.hard_n else None


@dataclass(frozen=True)
class PolicyRow(Row):
    """A policy on a selection, over all seeds."""

    policy: str
    n: int
    successes: int
    success_rate: float
    interval: Interval
    gain: Gain | None
    published: float | None


@dataclass(frozen=True)
class DistanceRow(Row):
    """A selection on the tests at one distance (cm) from the trained targets."""

    distance_cm: int
    n: int
    successes: int
    success_rate: float
    interval: Interval
    gain: Gain | None
    published: float | None


@dataclass(frozen=True)
class Mean:
    """A mean over trials with its t-interval and Welch's test against General, as the publication does."""

    value: float
    interval: Interval
    welch_test: PlainTest | None
    published: float | None


@dataclass(frozen=True)
class QualityRow(Row):
    """How a selection's rollouts went."""

    n: int
    final_distance: Mean
    settled_distance: Mean
    """At the step limit; the publication has none."""
    path_length: Mean
    joint_movement: Mean


@dataclass(frozen=True)
class FailureRow(Row):
    """One reason for which trials of a selection failed."""

    failure: str
    """collided, limits or lost."""
    failure_detail: str
    """What touched what first, or which joint's limit was broken; empty for lost trials."""
    n: int
    """Trials, successes included."""
    failures: int


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
class PoolRow:
    """What a study's candidates of one pool are worth."""

    scene: str
    pool_label: str
    targets: int
    candidates: int
    distinct: int
    degenerate: bool
    """Whether fewer than a third of the candidates differ."""


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
