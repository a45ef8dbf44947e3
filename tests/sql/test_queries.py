from __future__ import annotations

from typing import Any

import pytest
from scipy.stats import binomtest

from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.sql import load, names
from plancurate.tasks.lake.schema import TABLES
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study.statistics import wilson_interval

from ..lakes import POOL


def test_a_query_is_found_by_name_and_an_unknown_one_names_the_nearest() -> None:
    assert "SELECT" in load("results/by_policy")
    with pytest.raises(UnknownNameError, match="did you mean results/by_policy"):
        load("results/by_polcy")


@pytest.mark.parametrize("name", names())
def test_every_query_says_what_it_is(name: str) -> None:
    text = load(name)
    assert text.startswith("--") or name.startswith("audits/assert_")
    assert all(len(line) <= 110 for line in text.splitlines())


@pytest.mark.parametrize("name", TABLES)
def test_views_tell_rows_apart_by_the_identity_of_the_table(name: str) -> None:
    kind = TABLES[name]
    identity = [column for column in kind.identity if column != "run_at"]  # of a study the last run is shown
    clause = " ".join(load(f"views/{name}").split()).split("PARTITION BY ")[1].split(" ORDER BY")[0]
    assert clause == ", ".join((*kind.partition, *identity))


@pytest.mark.parametrize("name", names("examples"))
def test_examples_run_as_they_are_for_a_user(small_lake: Lake, maker: Any, name: str) -> None:
    study = maker.record("tiny", "aaaaaaaa")
    maker.select(study, "KMeans_Hybrid", 1, [(0, "RRT", 0)])
    maker.test(study, "KMeans_Hybrid", 1, "BC_MLP", "S.")
    assert small_lake.sql(load(name)).num_rows > 0


def test_joint_movement_in_sql_is_the_sum_of_absolute_steps(small_lake: Lake) -> None:
    statement = (
        "SELECT joint_movement([[0, 0], [1, -2], [1.5, -2]]) AS two_steps, "
        "joint_movement([[1, 2]]) AS one, joint_movement([]::FLOAT[][]) AS none, "
        "duration([[1], [2], [3]], 0.05::DOUBLE) AS duration"
    )
    assert small_lake.sql(statement).to_pylist() == [
        {"two_steps": 3.5, "one": 0.0, "none": 0.0, "duration": 0.1}
    ]


def test_waypoints_are_one_row_each(small_lake: Lake) -> None:
    rows = small_lake.sql(
        "SELECT step, t, q FROM waypoints WHERE trajectory_id = 't0000-RRT-r0-0a1b2c' ORDER BY step"
    ).to_pydict()
    assert rows["step"] == list(range(11))
    assert rows["t"] == pytest.approx([0.05 * step for step in range(11)])
    stored = small_lake.sql("SELECT q FROM trajectories WHERE trajectory_id = 't0000-RRT-r0-0a1b2c'")
    assert rows["q"] == stored["q"][0].as_py()


def test_planner_summary_counts_what_became_of_each_run(small_lake: Lake, maker: Any) -> None:
    study = maker.record("tiny", "aaaaaaaa")
    rows = {row["planner"]: row for row in small_lake.query("results/planners", study=study).to_pylist()}
    assert [rows["PRM"][name] for name in ("runs", "solved", "verified")] == [9, 9, 9]
    assert [rows["RRT"][name] for name in ("runs", "solved", "verified")] == [9, 8, 7]
    assert rows["RRT"]["commonest_reason"] == "no path"
    equal = small_lake.query("results/equal_candidates", study=study).to_pylist()
    assert [row["candidates"] for row in equal] == [6, 4, 6]


@pytest.mark.parametrize(("k", "n"), [(0, 7), (7, 7), (3, 10), (1, 1), (60_000, 150_000)])
def test_wilsons_interval_in_sql_is_scipys(small_lake: Lake, k: int, n: int) -> None:
    (row,) = small_lake.sql(f"SELECT wilson_low({k}, {n}) AS low, wilson_high({k}, {n}) AS high").to_pylist()
    assert list(row.values()) == pytest.approx(
        list(binomtest(k, n).proportion_ci(method="wilson")), abs=1e-12
    )


def test_without_trials_there_is_no_interval(small_lake: Lake) -> None:
    (row,) = small_lake.sql("SELECT wilson_low(0, 0) AS low, wilson_high(0, 0) AS high").to_pylist()
    assert row == {"low": None, "high": None}


@pytest.mark.parametrize(("one", "other"), [(0, 0), (3, 9), (5, 5), (0, 12), (400, 460)])
def test_the_paired_test_in_sql_is_scipys_binomial_test(small_lake: Lake, one: int, other: int) -> None:
    (row,) = small_lake.sql(f"SELECT paired_p({one}, {other}) AS p").to_pylist()
    expected = binomtest(one, one + other).pvalue if one + other else 1.0
    assert row["p"] == pytest.approx(expected, rel=1e-9)


def test_one_column_says_why_a_run_is_of_no_use(small_lake: Lake, maker: Any) -> None:
    maker.plan("RRT", 2, "hit", trajectory_id="hit", run=9, verified=False, verify_reason="contact of link_4")
    rows = small_lake.sql(
        "SELECT trajectory_id, solved, verified, failure_reason FROM trajectories"
    ).to_pylist()
    reasons = {row["trajectory_id"]: row["failure_reason"] for row in rows}
    assert reasons["hit"] == "contact of link_4"
    assert reasons["t0001-RRT-r1-0a1b2c"] == "no path"
    assert all(row["failure_reason"] is None for row in rows if row["verified"])


def test_one_column_says_why_a_rollout_failed(small_lake: Lake, maker: Any) -> None:
    maker.test(maker.record("tiny", "aaaaaaaa"), "General", None, "BC_MLP", "SRCL.")
    reasons = small_lake.sql("SELECT failure_reason FROM evaluations ORDER BY test_id")["failure_reason"]
    expected = [None, None, "collided: link_4 and table", "limits: joint_2 velocity", "lost"]
    assert reasons.to_pylist() == expected


def test_results_count_the_last_round_over_seeds(small_lake: Lake, maker: Any) -> None:
    study = maker.record("tiny", "aaaaaaaa")
    other = maker.record("other", "bbbbbbbb")
    maker.test(study, "General", None, "BC_MLP", "....", round=0)
    maker.test(study, "General", None, "BC_MLP", "SR..", round=1)
    maker.test(study, "General", None, "BC_MLP", "SSS.", round=1, seed=1)
    maker.test(study, "Random", 2, "BC_MLP", "S.", round=1)
    maker.test(other, "General", None, "BC_MLP", "..")
    rows = small_lake.sql(
        "SELECT name, study_key, selector, budget, round, n, successes, success_rate, success_low, settled_rate "
        "FROM results ORDER BY name DESC, selector"
    ).to_pylist()
    assert [list(row.values())[:7] for row in rows] == [
        ["tiny", "aaaaaaaa", "General", None, 1, 8, 5],
        ["tiny", "aaaaaaaa", "Random", 2, 1, 2, 1],
        ["other", "bbbbbbbb", "General", None, 0, 2, 0],
    ]
    assert rows[0]["success_rate"] == 0.625
    assert rows[0]["settled_rate"] == 0.5
    assert rows[0]["success_low"] == pytest.approx(wilson_interval(5, 8).low)


@pytest.mark.slow
def test_the_difference_of_selections_is_that_of_their_ids(small_lake: Lake, maker: Any) -> None:
    for study in (maker.record("tiny", "aaaaaaaa"), maker.record("other", "bbbbbbbb")):  # both use it
        maker.select(study, "KMeans", 1, [(0, "RRT", 0), (1, "RRT", 0)], score=1.5, rank=1)
    maker.select(study, "Random", 1, [(1, "RRT", 0), (2, "PRM", 0)])
    maker.select(study, "Random", 2, [(2, "PRM", 0)])
    rows = small_lake.sql("FROM selection_diff('KMeans', 'Random-1') ORDER BY target_id").to_pylist()
    shown = ("target_id", "planner", "kept_by", "score_a", "rank_a", "score_b")
    assert [tuple(row[name] for name in shown) for row in rows] == [
        (0, "RRT", "a", 1.5, 1, None),
        (1, "RRT", "both", 1.5, 1, None),
        (2, "PRM", "b", None, None, None),
    ]
    with pytest.raises(PlancurateError, match="2 selections begin with Random"):
        small_lake.sql("FROM selection_diff('KMeans', 'Random')")
    with pytest.raises(PlancurateError, match="0 selections begin with Nobody"):
        small_lake.sql("FROM selection_diff('Nobody', 'KMeans')")


def test_trials_of_another_study_are_taken_over_as_they_were_recorded(small_lake: Lake, maker: Any) -> None:
    study = maker.record("tiny", "aaaaaaaa")
    maker.test(study, "KMeans_Hybrid", 1, "BC_MLP", "SC")
    place = {**POOL, "study": study}
    key = "KMeans_Hybrid-1-BC_MLP-0-0-0-displaced"
    rows = small_lake.query("study/trials", evaluation_id=key, **place)
    small_lake.write("evaluations", {**POOL, "study": "other-bbbbbbbb"}, key, rows, {})
    taken = small_lake.sql(
        "SELECT failure_reason FROM evaluations WHERE study = 'other-bbbbbbbb' ORDER BY test_id"
    )
    assert taken["failure_reason"].to_pylist() == [None, "collided: link_4 and table"]


def test_reached_tests_are_of_the_first_ones_unseen_before_displaced(small_lake: Lake, maker: Any) -> None:
    study = maker.record("tiny", "aaaaaaaa")
    maker.test(study, "KMeans_Hybrid", 1, "BC_MLP", "SCSS", evaluation_id="one")
    maker.test(study, "KMeans_Hybrid", 1, "BC_MLP", ".S", kind="unseen", evaluation_id="one")

    def reached(tests: int) -> list[tuple[str, int]]:
        rows = small_lake.query(
            "study/reached", evaluation_id="one", tests=tests, **POOL, study=study
        ).to_pylist()
        return [(row["kind"], row["test_id"]) for row in rows]

    assert reached(1) == []
    assert reached(5) == [("unseen", 1), ("displaced", 0), ("displaced", 2)]
