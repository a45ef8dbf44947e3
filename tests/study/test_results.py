"""A study small enough to compute every number of its tables by hand."""

from __future__ import annotations

from typing import Any

import pytest

from plancurate.errors import PlancurateError
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study.results import StudyResults, headline_networks, study_results
from plancurate.tasks.study.rows import ALL_SCENES, REPORT_FIELDS, SummaryRow
from plancurate.tasks.study.statistics import Outcomes, two_proportion_test, wilson_interval

from ..lakes import copied
from ..studies import StudyMaker

FREE = {"robot": "h2017", "scene": "free", "pool": "0a1b2c"}
TABLE = {"robot": "h2017", "scene": "table", "pool": "3d4e5f"}


@pytest.fixture(scope="module")
def lake(small_lake_once: Lake, tmp_path_factory: pytest.TempPathFactory) -> Lake:
    """A lake for the two studies below; nothing else writes into it."""
    return copied(small_lake_once, tmp_path_factory.mktemp("results"))


@pytest.fixture(scope="module")
def results(lake: Lake) -> StudyResults:
    """General with one policy, a hybrid with two and, for one of them, two selection seeds."""
    maker = StudyMaker(lake)
    study = maker.record("tiny", "aaaaaaaa")
    maker.test(study, "General", None, "BC_MLP", "S..C")
    maker.test(study, "KMeans_Hybrid", 2, "BC_MLP", "SSSR")
    maker.test(study, "KMeans_Hybrid", 2, "BC_RNN", "SRRR")
    maker.test(study, "KMeans_Hybrid", 2, "BC_RNN", "SR.R", selection_seed=1)
    maker.test(study, "Random", 2, "BC_MLP", "SS.R")
    maker.test(study, "KMeans_Hybrid", 2, "BC_RNN", "..", kind="unseen")
    return study_results(lake, study)


def summary(results: StudyResults, selector: str, scene: str = "free") -> SummaryRow:
    rows = results.on("displaced").summaries
    return next(row for row in rows if (row.selector, row.scene) == (selector, scene))


@pytest.mark.slow
def test_networks_are_counted_one_by_one_with_wilsons_interval(results: StudyResults) -> None:
    rows = results.on("displaced").networks
    counts = [
        (r.selector, r.budget, r.policy, r.selection_seed, r.n, r.successes, r.settled_rate) for r in rows
    ]
    assert counts == [
        ("KMeans_Hybrid", 2, "BC_MLP", 0, 4, 4, 3 / 4),
        ("KMeans_Hybrid", 2, "BC_RNN", 0, 4, 4, 1 / 4),
        ("KMeans_Hybrid", 2, "BC_RNN", 1, 4, 3, 1 / 4),
        ("Random", 2, "BC_MLP", 0, 4, 3, 2 / 4),
        ("General", None, "BC_MLP", 0, 4, 1, 1 / 4),
    ]
    general = rows[-1]
    assert (general.final_distance, general.path_length, general.joint_movement) == pytest.approx(
        (0.015, 1.0, 3.5)
    )
    assert (general.selection_time_s, general.n_kept, general.success_rate) == (0.5, 4, 0.25)
    interval = wilson_interval(1, 4)
    assert (general.ci_low, general.ci_high) == (interval.low, interval.high)


def test_printed_rows_have_exactly_the_promised_fields(results: StudyResults) -> None:
    assert tuple(results.on("displaced").networks[0].report()) == REPORT_FIELDS
    assert ",".join(REPORT_FIELDS) == (
        "scene,pool_label,kind,selector,budget,policy,seed,selection_seed,round,"
        "n,successes,success_rate,ci_low,ci_high,settled,settled_rate,hard_n,hard_successes,hard_settled,"
        "final_distance,path_length,joint_movement,selection_time_s,n_kept"
    )


def test_totals_run_over_policies_and_seeds(results: StudyResults) -> None:
    hybrid = summary(results, "KMeans_Hybrid")
    assert (hybrid.n, hybrid.successes, hybrid.success_rate) == (12, 11, 11 / 12)
    assert hybrid.settled_rate == 5 / 12
    assert (hybrid.tests, hybrid.selection_seeds, hybrid.training_seeds) == (4, 2, 1)
    assert hybrid.final_distance == pytest.approx(0.015)
    assert (hybrid.selection_time_s, hybrid.n_kept) == (0.5, 4)
    assert hybrid.wilson == wilson_interval(11, 12)
    assert hybrid.published == 253 / 320
    assert hybrid.interval.low < 11 / 12 < hybrid.interval.high
    assert hybrid.settled_interval.low < 5 / 12 < hybrid.settled_interval.high
    assert hybrid.interval_over == "selection seeds and targets"
    assert summary(results, "General").interval_over == "targets only"


@pytest.mark.slow
def test_displaced_tests_that_were_left_out_are_counted(small_lake: Lake, maker: Any) -> None:
    study = maker.record("left-out", "aaaaaaaa", pools=[(FREE, ""), (TABLE, "")])
    maker.test(study, "General", None, "BC_MLP", 45 * "S")  # of 3 targets with 16 tests each
    maker.test(study, "General", None, "BC_MLP", 48 * "S", pool=TABLE)
    assert study_results(small_lake, study).dropped_tests == 3
    few = maker.record("few", "aaaaaaaa", config='{"displaced_targets": 2}')
    maker.test(few, "General", None, "BC_MLP", 30 * "S")  # of 2 of these targets
    assert study_results(small_lake, few).dropped_tests == 2


@pytest.mark.slow
def test_the_hard_subset_is_counted_apart(small_lake: Lake, maker: Any) -> None:
    study = maker.record("hard", "aaaaaaaa")
    maker.test(study, "General", None, "BC_MLP", "SSS.")
    maker.test(study, "General", None, "BC_MLP", "RC..", seed=1, hard=True)
    maker.test(study, "KMeans_Hybrid", 2, "BC_MLP", "SS..")
    results = study_results(small_lake, study)
    networks = {(row.selector, row.seed): row for row in results.on("displaced").networks}
    assert [
        (row.hard_n, row.hard_successes, row.hard_settled)
        for row in (networks["General", 0], networks["General", 1], networks["KMeans_Hybrid", 0])
    ] == [(0, 0, 0), (4, 1, 0), (0, 0, 0)]
    general, hybrid = summary(results, "General"), summary(results, "KMeans_Hybrid")
    assert (general.n, general.hard_n, general.hard_successes, general.hard_rate) == (8, 4, 1, 0.25)
    assert (hybrid.hard_n, hybrid.hard_rate) == (0, None)


def test_gains_are_tested_against_general_on_the_same_targets(results: StudyResults) -> None:
    hybrid, general = summary(results, "KMeans_Hybrid"), summary(results, "General")
    assert general.gain is None
    assert hybrid.gain is not None
    assert hybrid.gain.value == pytest.approx(11 / 12 - 1 / 4)
    plain = two_proportion_test(Outcomes(11, 12), Outcomes(1, 4))
    assert (hybrid.gain.z_test.statistic, hybrid.gain.z_test.p) == (plain.statistic, plain.p)
    assert hybrid.gain.z_test.stars == "**"
    # Random less General on four targets: 0, 1, 0, 1 and, imagined, 1 and -1: mean 1/3, variance (4 - 2/3) / 5.
    random = summary(results, "Random").gain
    assert random is not None
    assert random.value == 0.5
    assert random.error == pytest.approx(((4 - 2 / 3) / 5 / 6) ** 0.5, rel=0.03)
    assert random.interval.low == pytest.approx(1 / 3 - 1.96 * random.error, abs=1e-3)
    assert random.holm_p == pytest.approx(max(random.p, 2 * hybrid.gain.p))
    assert random.stars == "ns"


def test_ranks_go_by_rate_and_ties_by_the_test_against_the_first(results: StudyResults) -> None:
    rows = results.on("displaced").summaries
    assert [(row.selector, row.rank, row.best) for row in rows] == [
        ("KMeans_Hybrid", 1, True),
        ("Random", 2, True),
        ("General", 3, True),  # four targets tell nothing apart
    ]


@pytest.mark.slow
def test_what_is_clearly_worse_does_not_tie(small_lake: Lake, maker: Any) -> None:
    study = maker.record("clear", "aaaaaaaa")
    maker.test(study, "General", None, "BC_MLP", 20 * "S" + 20 * ".")
    maker.test(study, "KMeans", 1, "BC_MLP", 39 * "S" + ".")
    maker.test(study, "DBSCAN", 1, "BC_MLP", "." + 39 * "S")
    rows = study_results(small_lake, study).headline.summaries
    assert [(row.selector, row.rank, row.best) for row in rows] == [
        ("DBSCAN", 1, True),
        ("KMeans", 1, True),
        ("General", 3, False),
    ]
    gains = [row.gain for row in rows if row.gain]
    assert [gain.stars for gain in gains] == ["***", "***"]


def test_each_policy_and_distance_is_compared_with_generals_own(results: StudyResults) -> None:
    policies = {(row.selector, row.policy): row for row in results.on("displaced").policies}
    assert policies["KMeans_Hybrid", "BC_RNN"].gain is None  # General has no such network
    mlp = policies["KMeans_Hybrid", "BC_MLP"]
    assert mlp.gain is not None
    assert (mlp.successes, mlp.n, mlp.gain.value, mlp.published) == (4, 4, 0.75, 59 / 80)
    distances = {(row.selector, row.distance_cm): row for row in results.on("displaced").distances}
    third = distances["KMeans_Hybrid", 2]
    assert third.gain is not None
    assert (third.successes, third.n, third.gain.value) == (2, 3, 2 / 3)
    assert third.interval.low < 2 / 3 < third.interval.high
    # One target, difference 1, and imagined 1 and -1: mean 1/3, variance (3 - 1/3) / 2 / 3.
    assert distances["Random", 1].gain is not None
    assert distances["Random", 1].gain.error == pytest.approx((8 / 3 / 2 / 3) ** 0.5, rel=0.03)


def test_unseen_targets_are_reported_apart_and_first(results: StudyResults, lake: Lake) -> None:
    assert list(results.tests) == ["unseen", "displaced"]
    (row,) = results.headline.networks
    assert (row.selector, row.n, row.successes) == ("KMeans_Hybrid", 2, 0)
    assert results.headline.summaries[0].gain is None
    assert results.headline.summaries[0].published is None
    assert (results.headline.agreement, results.headline.distances) == ([], [])
    assert headline_networks(lake, results.study.study) == results.headline.networks


@pytest.mark.slow
def test_a_kind_of_test_that_a_study_lacks_is_named(small_lake: Lake, maker: Any) -> None:
    study = maker.record("plain", "aaaaaaaa")
    maker.test(study, "General", None, "BC_MLP", "S")
    with pytest.raises(PlancurateError, match="study plain-aaaaaaaa: no unseen tests; it has displaced"):
        study_results(small_lake, study).on("unseen")


@pytest.fixture(scope="module")
def scenes(lake: Lake) -> StudyResults:
    """Two scenes; Random is tested in one of them only."""
    maker = StudyMaker(lake)
    study = maker.record("both", "aaaaaaaa", pools=((FREE, ""), (TABLE, "")))
    for pool, general, hybrid in ((FREE, "S...", "SSS."), (TABLE, "..", "S.")):
        maker.test(study, "General", None, "BC_MLP", general, pool=pool)
        maker.test(study, "KMeans_Hybrid", 2, "BC_MLP", hybrid, pool=pool)
    maker.test(study, "Random", 2, "BC_MLP", "SSSS", pool=FREE)
    maker.select(study, "KMeans_Hybrid", 2, [(0, "RRT", 0)], pool=FREE)
    return study_results(lake, study)


@pytest.mark.slow
def test_several_scenes_have_rows_of_their_own_and_a_total(scenes: StudyResults) -> None:
    rows = [
        (row.scene, row.selector, row.successes, row.n, row.tests, row.rank)
        for row in scenes.headline.summaries
    ]
    assert rows == [
        (ALL_SCENES, "KMeans_Hybrid", 4, 6, 6, 1),
        (ALL_SCENES, "General", 1, 6, 6, 2),
        ("free", "Random", 4, 4, 4, 1),
        ("free", "KMeans_Hybrid", 3, 4, 4, 2),
        ("free", "General", 1, 4, 4, 3),
        ("table", "KMeans_Hybrid", 1, 2, 2, 1),
        ("table", "General", 0, 2, 2, 2),
    ]
    total = summary(scenes, "KMeans_Hybrid", ALL_SCENES)
    assert total.gain is not None
    assert total.gain.value == 0.5
    # Both scenes' differences vary on their own: free 0, 1, 1, 0 and table 1, 0, each with 1 and -1 imagined.
    free, table = (4 - 4 / 6) / 5 * 6, (3 - 1 / 4) / 3 * 4
    assert total.gain.error == pytest.approx((free + table) ** 0.5 / 10, rel=0.03)
    assert {row.scene for row in scenes.headline.quality} == {ALL_SCENES, "free", "table"}
    assert {row.scene for row in scenes.headline.networks} == {"free", "table"}


@pytest.mark.slow
def test_variants_of_candidates_are_kept_apart(small_lake: Lake, maker: Any) -> None:
    other = {**FREE, "pool": "777777"}
    study = maker.record("variants", "aaaaaaaa", pools=((FREE, "pose"), (other, "nearest")))
    maker.test(study, "General", None, "BC_MLP", "S...", pool=FREE)
    maker.test(study, "General", None, "BC_MLP", "SS..", pool=other)
    rows = study_results(small_lake, study).headline.summaries
    assert [(row.scene, row.pool_label, row.successes) for row in rows] == [
        ("free", "nearest", 2),
        ("free", "pose", 1),
    ]


@pytest.mark.slow
def test_selection_times_are_means_over_selection_seeds(small_lake: Lake, maker: Any) -> None:
    study = maker.record("times", "aaaaaaaa")
    for seed, seconds in enumerate((1.0, 2.0, 3.0)):
        maker.select(
            study, "CUPID", 2, [(0, "RRT", 0)], seed=seed, selection_time_s=seconds, score_s=seconds / 2
        )
    maker.select(study, "General", None, [(0, "RRT", 0)])
    maker.test(study, "CUPID", 2, "BC_MLP", "SS")
    maker.test(study, "General", None, "BC_MLP", "S.")
    cupid, general = study_results(small_lake, study).times
    assert (cupid.n, cupid.total, cupid.seconds["score"]) == (3, 2.0, 1.0)
    half = 4.302653 / 3**0.5  # t(2)
    assert cupid.interval is not None
    assert (cupid.interval.low, cupid.interval.high) == pytest.approx((2 - half, 2 + half), abs=1e-5)
    assert (cupid.published, cupid.published_n) == (1012.19, 18)
    assert cupid.published_interval is not None
    assert (cupid.published_interval.low, cupid.published_interval.high) == (793, 1232)
    assert (general.n, general.interval, general.published) == (1, None, 0.0)


@pytest.mark.slow
def test_a_pool_of_copies_is_called_degenerate(small_lake: Lake, maker: Any) -> None:
    same = {"joint_movement": 1.0, "path_length": 1.0, "smoothness": 1.0}
    for run in range(7):
        maker.plan("EST", 0, run=run, trajectory_id=f"copy{run}", key=f"copy{run}", **same)
    study = maker.record("copies", "aaaaaaaa", planners=["EST"], n_targets=1)
    maker.test(study, "General", None, "BC_MLP", "S")
    (pool,) = study_results(small_lake, study).pools
    assert (pool.candidates, pool.distinct, pool.degenerate) == (7, 1, True)


@pytest.mark.slow
def test_results_are_of_the_last_round_and_rows_of_every_one(small_lake: Lake, maker: Any) -> None:
    study = maker.record("rounds", "aaaaaaaa")
    for round, outcomes in enumerate(("S...", "SS..", "SSS.")):
        maker.test(study, "General", None, "BC_MLP", outcomes, round=round)
    maker.select(study, "General", None, [(0, "RRT", 0)])
    headline = study_results(small_lake, study).headline
    assert [(row.round, row.successes, row.n) for row in headline.networks] == [
        (0, 1, 4),
        (1, 2, 4),
        (2, 3, 4),
    ]
    (summary,) = headline.summaries
    assert (summary.successes, summary.n, summary.success_rate) == (3, 4, 0.75)
    assert [(row.successes, row.n) for row in headline.policies] == [(3, 4)]
