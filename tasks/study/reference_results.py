"""Success of what is no policy, on the tests of the policies."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from plancurate.tasks.study.against import SqlRow
from plancurate.tasks.study.rows import SceneRow
from plancurate.tasks.study.statistics import Interval, wilson_interval

PLANNER, REPLAY, STRAIGHT_LINE = "Planner", "Replay", "StraightLine"


@dataclass(frozen=True)
class ReferenceRow(SceneRow):
    """One reference in a scene; it settles where it succeeds, for then it ends at the target."""

    reference: str
    """Planner, Replay or StraightLine."""
    n: int
    """Tests."""
    successes: int
    success_rate: float
    interval: Interval
    """Wilson's."""
    hard_n: int
    """Tests of the hard subset: the straight joint line to the nearest goal is not free."""
    hard_successes: int

    @property
    def hard_rate(self) -> float | None:
        """Success on the hard subset; None where no test is of it."""
        return self.hard_successes / self.hard_n if self.hard_n else None


def reference_row(row: SqlRow) -> ReferenceRow:
    """One row of results/references with its rate."""
    return ReferenceRow(
        **row,
        success_rate=row["successes"] / row["n"],
        interval=wilson_interval(row["successes"], row["n"]),
    )


def of_group(rows: Iterable[ReferenceRow], group: tuple[str, str]) -> dict[str, ReferenceRow]:
    """The references of a scene and pool label by name."""
    return {row.reference: row for row in rows if row.group == group}
