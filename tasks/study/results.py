"""All results of a study, computed here and nowhere else: who shows them only formats them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from plancurate.errors import PlancurateError
from plancurate.tasks.lake.held import held
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.learning.settings import TESTS_BY_DISTANCE
from plancurate.tasks.study.pools import study_pools
from plancurate.tasks.study.rows import ALL_SCENES, ResultRow
from plancurate.tasks.study.selection_results import (
    below_random_rows,
    coverage_rows,
    planner_rows,
    ranking_rows,
    time_rows,
)
from plancurate.tasks.study.selection_rows import (
    BelowRandomRow,
    CoverageRow,
    PlannerRow,
    PoolRow,
    RankingRow,
    TimeRow,
)
from plancurate.tasks.study.studies import Study, recorded_study
from plancurate.tasks.study.trial_results import Kind, KindResults, in_order, kind_results, network_rows

KINDS: tuple[Kind, ...] = ("unseen", "unseen_scene", "displaced")  # the more telling one first


@dataclass(frozen=True)
class StudyResults:
    """All results of a study."""

    study: Study
    tests: Mapping[Kind, KindResults]
    """Those kinds of test that the study has, the one for headlines first."""
    pools: list[PoolRow]
    times: list[TimeRow]
    coverage: list[CoverageRow]
    planners: list[PlannerRow]
    rankings: list[RankingRow]
    below_random: list[BelowRandomRow]
    pool_hashes: list[str]
    seconds: Mapping[str, float]
    """Of work by stage, over all processes."""

    def on(self, kind: Kind) -> KindResults:
        """The results on one kind of test; PlancurateError when the study has none."""
        if kind not in self.tests:
            raise PlancurateError(
                f"study {self.study.study}: no {kind} tests; it has {', '.join(self.tests)}"
            )
        return self.tests[kind]

    @property
    def dropped_tests(self) -> int:
        """How many displaced test targets are left out, for no planner reaches them."""
        each, targets = sum(TESTS_BY_DISTANCE.values()), self.study.pools[0].n_targets
        around = self.study.config.get("displaced_targets")
        drawn = each * (targets if around is None else min(around, targets))
        tested = {row.group: row.tests for row in self.on("displaced").summaries if row.scene != ALL_SCENES}
        return sum(drawn - tests for tests in tested.values())

    @property
    def headline(self) -> KindResults:
        """The results to show first."""
        return next(iter(self.tests.values()))


def study_results(lake: Lake, study: str) -> StudyResults:
    """Compute every result of a study, by its identifier; PlancurateError when it has no trials yet."""
    with held(lake, study) as lake:
        return _results(lake, study)


def _results(lake: Lake, study: str) -> StudyResults:
    record = recorded_study(lake, study)
    tests = {kind: one for kind in KINDS if (one := kind_results(lake, study, kind)).networks}
    if not tests:
        raise PlancurateError(f"study {study}: nothing is tested yet; run the study to its end")
    summaries = next(iter(tests.values())).summaries
    times, coverage, planners, (seconds,) = (
        lake.query(f"results/{name}", study=study).to_pylist()
        for name in ("selection_times", "coverage", "planners_kept", "seconds")
    )
    covered = in_order(coverage_rows(coverage), summaries)
    return StudyResults(
        study=record,
        tests=tests,
        pools=study_pools(lake, study),
        times=in_order(time_rows(times), summaries),
        coverage=covered,
        planners=in_order(planner_rows(planners), summaries),
        rankings=in_order(ranking_rows(lake, study), summaries),
        below_random=below_random_rows(summaries, covered),
        pool_hashes=sorted({row["pool_hash"] for row in times}),
        seconds={stage: spent or 0.0 for stage, spent in seconds.items()},
    )


def headline_networks(lake: Lake, study: str) -> list[ResultRow]:
    """Result rows of a study's networks, of each pool on the first kind of test that it has; nothing takes time."""
    found: list[ResultRow] = []
    for kind in KINDS:
        known = {row.group for row in found}
        found += [row for row in network_rows(lake, study, kind) if row.group not in known]
    return found
