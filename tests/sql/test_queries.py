from __future__ import annotations

from typing import Any

import pytest

from plancurate.errors import UnknownNameError
from plancurate.sql import load, names
from plancurate.tasks.lake.schema import TABLES
from plancurate.tasks.lake.store import Lake


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
        "SELECT joint_movement_of([[0, 0], [1, -2], [1.5, -2]]) AS two_steps, "
        "joint_movement_of([[1, 2]]) AS one, joint_movement_of([]::FLOAT[][]) AS none, "
        "duration_of([[1], [2], [3]], 0.05::DOUBLE) AS duration"
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
