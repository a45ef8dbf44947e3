"""A study small enough to compute every number of its table by hand."""

from __future__ import annotations

from datetime import UTC, datetime

import pyarrow as pa
import pytest

from plancurate.errors import UnknownNameError
from plancurate.tasks.lake.schema import table
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study.results import REPORT_FIELDS, find_study, result_rows, summary_rows
from plancurate.tasks.study.statistics import two_proportion_test, wilson_interval

POOL = {"robot": "h2017", "scene": "free", "pool": "0a1b2c"}


def trials(
    selector: str, budget: int | None, policy: str, outcomes: str, kind: str = "displaced"
) -> pa.Table:
    """One trial a letter: S settled, R reached only, C reached but collided, . missed."""
    rows = [
        {
            "evaluation_id": f"{selector}-{policy}-{kind}", "selection_id": f"{selector}-1",
            "selector": selector, "budget": budget, "policy": policy, "seed": 0, "n_kept": 4,
            "selection_time_s": 0.5, "train_s": 1.0, "test_id": number, "kind": kind, "target_id": 0,
            "distance_cm": number, "x": 0.0, "y": 0.0, "z": 0.0, "success": outcome in "SR",
            "settled": outcome == "S", "reached": outcome != ".", "collided": outcome == "C",
            "out_of_limits": False, "steps": 10, "final_distance": 0.01 * number, "path_length": 1.0,
            "joint_movement": 2.0 + number, "settled_distance": 0.0,
        }
        for number, outcome in enumerate(outcomes)
    ]  # fmt: skip
    return pa.Table.from_pylist(rows, table("evaluations").schema)


def add_study(lake: Lake, name: str, key: str, day: int, evaluations: list[pa.Table]) -> None:
    """Record a study and its trials."""
    study = {
        "study_key": key, "config": "{}", **POOL, "created_at": datetime(2026, 1, day, tzinfo=UTC),
        "package_version": "0", "ompl_version": "1.5.2",
    }  # fmt: skip
    studies = pa.Table.from_pylist([study], table("studies").schema)
    lake.write("studies", {"study": name}, key, studies, {})
    for number, rows in enumerate(evaluations):
        lake.write("evaluations", {**POOL, "study": f"{name}-{key}"}, f"e{number}", rows, {})


@pytest.fixture
def lake(small_lake: Lake) -> Lake:
    """A study done twice with other configurations, the later one with three result rows."""
    add_study(small_lake, "tiny", "aaa", 1, [trials("General", None, "BC_MLP", "....")])
    later = [
        trials("General", None, "BC_MLP", "S..C"),
        trials("KMeans_Hybrid", 2, "BC_MLP", "SSSR"),
        trials("KMeans_Hybrid", 2, "BC_RNN", "SRRRSR"),
        trials("KMeans_Hybrid", 2, "BC_RNN", "..", kind="unseen"),
    ]
    add_study(small_lake, "tiny", "bbb", 2, later)
    return small_lake


def test_result_rows_are_counted_per_selector_budget_policy_and_seed(lake: Lake) -> None:
    rows = result_rows(lake, "tiny")
    counts = [(r.selector, r.budget, r.policy, r.n, r.successes, r.settled_rate) for r in rows]
    assert counts == [
        ("General", None, "BC_MLP", 4, 1, 1 / 4),
        ("KMeans_Hybrid", 2, "BC_MLP", 4, 4, 3 / 4),
        ("KMeans_Hybrid", 2, "BC_RNN", 6, 6, 2 / 6),
    ]
    first = rows[0]
    assert (first.final_distance, first.path_length, first.joint_movement) == pytest.approx((0.015, 1.0, 3.5))
    assert (first.selection_time_s, first.n_kept, first.success_rate) == (0.5, 4, 0.25)
    interval, settled = wilson_interval(1, 4), wilson_interval(2, 6)
    assert (first.ci_low, first.ci_high) == (interval.low, interval.high)
    assert (rows[2].settled_ci_low, rows[2].settled_ci_high) == (settled.low, settled.high)


def test_printed_rows_have_exactly_the_promised_fields(lake: Lake) -> None:
    assert tuple(result_rows(lake, "tiny")[0].report()) == REPORT_FIELDS
    assert ",".join(REPORT_FIELDS) == (
        "selector,budget,policy,seed,n,successes,success_rate,ci_low,ci_high,settled_rate,final_distance,"
        "path_length,joint_movement,selection_time_s,n_kept"
    )


def test_totals_run_over_policies_and_are_tested_against_general(lake: Lake) -> None:
    hybrid, general = summary_rows(lake, "tiny")
    assert (hybrid.selector, hybrid.n, hybrid.successes, hybrid.settled_rate) == (
        "KMeans_Hybrid",
        10,
        10,
        0.5,
    )
    assert hybrid.final_distance == pytest.approx((0.015 * 4 + 0.025 * 6) / 10)
    test = two_proportion_test(10, 10, 1, 4)
    assert (hybrid.z, hybrid.p, hybrid.stars) == (test.statistic, test.p, "**")
    assert (general.n, general.successes, general.z, general.stars) == (4, 1, None, None)
    assert (hybrid.selection_time_s, hybrid.n_kept) == (0.5, 4)


def test_unseen_targets_are_reported_apart(lake: Lake) -> None:
    (row,) = result_rows(lake, "tiny", kind="unseen")
    assert (row.selector, row.n, row.successes) == ("KMeans_Hybrid", 2, 0)
    (total,) = summary_rows(lake, "tiny", kind="unseen")
    assert total.stars is None  # there is no General to compare with


def test_a_plain_name_means_the_latest_study_of_that_name(lake: Lake) -> None:
    assert find_study(lake, "tiny") == "tiny-bbb"
    assert find_study(lake, "tiny-aaa") == "tiny-aaa"
    assert result_rows(lake, "tiny-aaa")[0].successes == 0
    with pytest.raises(UnknownNameError, match="did you mean tiny"):
        result_rows(lake, "tinny")
