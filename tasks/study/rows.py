"""Rows of a study's results. Rates are shares of 1, lengths m, joint movement rad, times s.

Every row is about one scene, or all of several, and one variant of its candidates (pool_label, empty where a study
has one). Where the publication has a number for the same thing, `published` holds it.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

from plancurate.tasks.curation.names import label
from plancurate.tasks.study.statistics import Interval

ALL_SCENES = "all scenes"
"""Scene of the rows that go over all of several scenes; no scene can have this name."""
REPORT_FIELDS = (
    "scene", "pool_label", "kind", "selector", "budget", "policy", "seed", "selection_seed", "round",
    "n", "successes", "success_rate", "ci_low", "ci_high", "settled", "settled_rate",
    "hard_n", "hard_successes", "hard_settled",
    "final_distance", "path_length", "joint_movement", "selection_time_s", "n_kept",
)  # fmt: skip


class Cell(NamedTuple):
    """A selection in a scene."""

    scene: str
    pool_label: str
    selector: str
    budget: int | None
    """Trajectories a target; None where the selector has no budget."""


@dataclass(frozen=True)
class SceneRow:
    """Where a row is about."""

    scene: str
    pool_label: str

    @property
    def group(self) -> tuple[str, str]:
        """Scene and pool label: rows of a group are compared with each other."""
        return self.scene, self.pool_label

    @property
    def group_title(self) -> str:
        """Scene and pool label as the head of a column."""
        return f"{self.scene} {self.pool_label}".strip()


@dataclass(frozen=True)
class Row(SceneRow):
    """What a row is about."""

    selector: str
    budget: int | None

    @property
    def cell(self) -> Cell:
        """The selection and where."""
        return Cell(self.scene, self.pool_label, self.selector, self.budget)

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
    """A policy trained on one selection with one seed, on one kind of test; Wilson's intervals."""

    kind: str
    """'unseen', 'unseen_scene' or 'displaced'."""
    policy: str
    seed: int
    selection_seed: int
    round: int
    """Of corrections; 0 before any."""
    n: int
    successes: int
    success_rate: float
    ci_low: float
    ci_high: float
    settled: int
    settled_rate: float
    settled_ci_low: float
    settled_ci_high: float
    hard_n: int
    """Trials whose straight line in joint space is not free; the next two count those of them."""
    hard_successes: int
    hard_settled: int
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
    motions: int
    """Successes that were timed and verified as motions; 0 where the study verifies none."""
    motions_passed: int
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

    @property
    def motion_rate(self) -> float | None:
        """Share of the verified rollouts that the robot may run; None where none was verified."""
        return self.motions_passed / self.motions if self.motions else None


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
