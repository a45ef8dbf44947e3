"""Queries of the report page on a lake whose numbers can be counted by hand."""

from __future__ import annotations

import math
from typing import Any

import pytest

from plancurate.tasks.lake.store import Lake

FREE = {"robot": "h2017", "scene": "free", "pool": "0a1b2c"}
TABLE = {"robot": "h2017", "scene": "table", "pool": "3d4e5f"}


@pytest.fixture
def study(maker: Any) -> str:
    """General with one network, DBSCAN with three; and another study that must not count."""
    study = maker.record("tiny", "aaaaaaaa")
    maker.test(study, "General", None, "BC_MLP", "S")
    maker.test(study, "DBSCAN", 2, "BC_MLP", "SR..")
    maker.test(study, "DBSCAN", 2, "BC_MLP", "R...", seed=1, path_length=2.0)
    maker.test(study, "DBSCAN", 2, "BC_RNN", "SSSR")
    maker.test(study, "DBSCAN", 2, "BC_RNN", "..", kind="unseen")
    other = maker.record("other", "aaaaaaaa")
    maker.test(other, "DBSCAN", 1, "BC_MLP", "SSSS")
    for selector, budget, kept in (
        ("General", None, [(0, "PRM", 0), (0, "RRT", 0), (1, "RRT", 0), (2, "RRT", 0)]),
        ("DBSCAN", 2, [(0, "RRT", 0), (0, "PRM", 0), (1, "PRM", 0)]),
    ):
        maker.select(study, selector, budget, kept)
    maker.select(other, "DBSCAN", 2, [(0, "RRT", 0)])
    return str(study)


def answer(lake: Lake, name: str, study: str, kind: str = "displaced") -> list[tuple[Any, ...]]:
    """Rows of a query as tuples without scene and pool label, which are the same throughout."""
    rows = lake.query(f"results/{name}", study=study, kind=kind).to_pylist()
    assert {(row.pop("scene"), row.pop("pool_label")) for row in rows} <= {("free", "")}
    return [tuple(row.values()) for row in rows]


def test_success_by_policy_runs_over_seeds(small_lake: Lake, study: str) -> None:
    assert answer(small_lake, "by_policy", study) == [
        ("DBSCAN", 2, "BC_MLP", 8, 3, 1),
        ("DBSCAN", 2, "BC_RNN", 4, 4, 3),
        ("General", None, "BC_MLP", 1, 1, 1),
    ]
    assert answer(small_lake, "by_policy", study, "unseen") == [("DBSCAN", 2, "BC_RNN", 2, 0, 0)]


def test_success_by_distance_runs_over_policies_and_seeds(small_lake: Lake, study: str) -> None:
    assert answer(small_lake, "by_distance", study) == [
        ("DBSCAN", 2, 0, 3, 3, 2),
        ("DBSCAN", 2, 1, 3, 2, 1),
        ("DBSCAN", 2, 2, 3, 1, 1),
        ("DBSCAN", 2, 3, 3, 1, 0),
        ("General", None, 0, 1, 1, 1),
    ]


def test_fresh_targets_have_no_distance(small_lake: Lake, study: str) -> None:
    assert answer(small_lake, "by_distance", study, "unseen") == []


def test_outcomes_are_lists_by_test_target(small_lake: Lake, study: str) -> None:
    rows = answer(small_lake, "outcomes", study)
    assert rows[1] == (
        "DBSCAN", 2, "BC_MLP", 1, 0, [0, 1, 2, 3], [True, False, False, False], [False] * 4, [0, 1, 2, 3],
    )  # fmt: skip
    (unseen,) = answer(small_lake, "outcomes", study, "unseen")
    assert unseen[-1] == [-1, -1]


def test_failures_are_counted_by_reason_and_detail(small_lake: Lake, maker: Any) -> None:
    study = maker.record("failing", "aaaaaaaa")
    maker.test(study, "DBSCAN", 2, "BC_MLP", "SCLL")
    maker.test(study, "DBSCAN", 2, "BC_RNN", "C..R")
    maker.test(study, "DBSCAN", 2, "BC_RNN", "C", seed=1, failure_detail="link_4 and ground")
    maker.test(study, "General", None, "BC_MLP", "SR")
    maker.test(study, "General", None, "BC_MLP", "L", kind="unseen")
    assert answer(small_lake, "failures", study) == [
        ("DBSCAN", 2, "collided", "link_4 and table", 9, 2),
        ("DBSCAN", 2, "limits", "joint_2 velocity", 9, 2),
        ("DBSCAN", 2, "lost", "", 9, 2),
        ("DBSCAN", 2, "collided", "link_4 and ground", 9, 1),
    ]


def test_quality_has_means_and_sample_deviations(small_lake: Lake, study: str) -> None:
    dbscan, general = small_lake.query("results/quality", study=study, kind="displaced").to_pylist()
    assert (dbscan["selector"], dbscan["budget"], dbscan["n"]) == ("DBSCAN", 2, 12)
    # Three times 0, 1, 2, 3 cm: squares about 1.5 cm sum to 3 * 5, over n - 1 = 11.
    assert dbscan["final_distance"] == pytest.approx(0.015)
    assert dbscan["final_distance_std"] == pytest.approx(0.01 * math.sqrt(15 / 11))
    assert dbscan["settled_distance"] == pytest.approx(0.03)
    assert dbscan["settled_distance_std"] == pytest.approx(0.02 * math.sqrt(15 / 11))
    # Four rollouts of 2 m, eight of 1 m.
    assert dbscan["path_length"] == pytest.approx(4 / 3)
    assert dbscan["path_length_std"] == pytest.approx(math.sqrt((4 * (2 / 3) ** 2 + 8 * (1 / 3) ** 2) / 11))
    assert (general["n"], general["path_length"], general["path_length_std"]) == (1, 1.0, None)


def test_planners_kept_are_those_of_the_studys_own_selections(small_lake: Lake, study: str) -> None:
    rows = small_lake.query("results/planners_kept", study=study).to_pylist()
    assert [(row["selector"], row["budget"], row["planner"], row["kept"]) for row in rows] == [
        ("DBSCAN", 2, "PRM", 2),
        ("DBSCAN", 2, "RRT", 1),
        ("General", None, "RRT", 3),
        ("General", None, "PRM", 1),
    ]
    assert [row["share"] for row in rows] == pytest.approx([2 / 3, 1 / 3, 3 / 4, 1 / 4])


def test_all_scenes_hold_the_selections_that_no_scene_lacks(small_lake: Lake, maker: Any) -> None:
    study = maker.record("both", "aaaaaaaa", pools=((FREE, "raw"), (TABLE, "raw")))
    for pool, outcomes in ((FREE, "SS."), (TABLE, "S.")):
        maker.test(study, "KMeans", 1, "BC_MLP", outcomes, pool=pool)
    maker.test(study, "KMeans", 5, "BC_MLP", "S", pool=FREE)
    rows = small_lake.query("results/by_selector", study=study, kind="displaced").to_pylist()
    assert [(row["scene"], row["budget"], row["n"], row["successes"], row["tests"]) for row in rows] == [
        ("all scenes", 1, 5, 3, 5),
        ("free", 5, 1, 1, 1),
        ("free", 1, 3, 2, 3),
        ("table", 1, 2, 1, 2),
    ]


def contrast(lake: Lake, study: str) -> list[tuple[Any, ...]]:
    """Outcome, selector, policy, test of the trials that are shown beside each other."""
    rows = lake.query(
        "pictures/contrast",
        study=study,
        kind="displaced",
        scene="free",
        pool_label="",
        selector="DBSCAN",
        budget=2,
        against="General",
    ).to_pylist()
    return [tuple(row[name] for name in ("success", "selector", "policy", "test_id")) for row in rows]


def test_a_success_and_a_failure_are_of_a_test_that_came_out_both_ways(small_lake: Lake, maker: Any) -> None:
    study = maker.record("contrast", "aaaaaaaa")
    maker.test(study, "DBSCAN", 2, "BC_MLP", "S.SS")
    assert contrast(small_lake, study) == [
        (True, "DBSCAN", "BC_MLP", 0),
        (False, "DBSCAN", "BC_MLP", 1),  # for want of a test that came out both ways
    ]
    maker.test(study, "Random", 2, "BC_RNN", "SSS.")
    assert [row[-1] for row in contrast(small_lake, study)] == [1, 1]
    maker.test(study, "General", None, "BC_RNN", "SS.C")
    assert contrast(small_lake, study) == [
        (True, "DBSCAN", "BC_MLP", 3),
        (False, "General", "BC_RNN", 3),  # rather what touches something than what was merely lost
    ]


def test_where_nothing_failed_there_is_a_success_alone(small_lake: Lake, maker: Any) -> None:
    study = maker.record("contrast", "aaaaaaaa")
    maker.test(study, "DBSCAN", 2, "BC_MLP", "SS")
    assert contrast(small_lake, study) == [(True, "DBSCAN", "BC_MLP", 0)]
