"""A study's numbers are its own, whatever else its home holds."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

import pytest

from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.sql import load, names
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study.results import study_results
from plancurate.tasks.study.studies import find_study

KEPT = [(0, "PRM", 0), (1, "PRM", 0), (2, "PRM", 0)]
POOL = {"robot": "h2017", "scene": "free", "pool": "0a1b2c"}


@pytest.fixture
def study(maker: Any) -> str:
    """A study of two of the pool's three targets and one of its planners."""
    study = maker.record("tiny", "aaaaaaaa", planners=["PRM"], n_targets=2)
    for selector, budget, outcomes in (("General", None, "S..."), ("KMeans", 1, "SSR.")):
        maker.select(study, selector, budget, KEPT[:2], n_targets=2)
        for kind in ("displaced", "unseen"):
            for seed in (0, 1):
                maker.test(study, selector, budget, "BC_MLP", outcomes[seed:], seed=seed, kind=kind)
    for kind in ("displaced", "unseen"):
        maker.refer(study, kind=kind, Planner="SS", Replay=".s", StraightLine="Sh")
    maker.rank("KMeans", 1, 0.5)
    return str(study)


def add_neighbours(maker: Any) -> None:
    """Other studies of the same pool, with more planners and targets, the same selections and others."""
    maker.rank("DBSCAN", 5, 0.1)
    maker.plan("EST", 0, joint_movement=0.001, goal_index=7)
    maker.plan("PRM", 2, trajectory_id="another", joint_movement=0.001, goal_index=7)
    for name, key in (("tiny", "bbbbbbbb"), ("other", "aaaaaaaa")):
        study = maker.record(name, key, run_at=datetime(2026, 2, 1, tzinfo=UTC))
        for selector, budget in (("General", None), ("KMeans", 1), ("DBSCAN", 5)):
            maker.select(study, selector, budget, [(0, "RRT", 1), *KEPT], selection_time_s=9.0)
            for kind in ("displaced", "unseen"):
                maker.test(study, selector, budget, "BC_MLP", "RRRRRR", kind=kind)
                maker.test(study, selector, budget, "BC_RNN", "......", kind=kind)
        for kind in ("displaced", "unseen"):
            maker.refer(study, kind=kind, Planner="....", Replay="SSSS", StraightLine="hhhh")


def answers(lake: Lake, study: str) -> dict[str, list[Any]]:
    """Rows of every result query about one study."""
    found = {}
    for name in names("results"):
        text = "\n".join(line.split("--")[0] for line in load(name).splitlines())
        if "$study" not in text:
            continue
        for kind in ("displaced", "unseen") if "$kind" in text else (None,):
            parameters = {"study": study} | ({"kind": kind} if kind else {})
            found[f"{name} {kind}"] = lake.query(name, **parameters).to_pylist()
    return found


@pytest.mark.slow
def test_a_second_study_in_the_same_home_changes_no_number_of_the_first(
    small_lake: Lake, maker: Any, study: str
) -> None:
    before, rows = study_results(small_lake, study), answers(small_lake, study)
    assert len(rows) >= 15
    assert [name for name, found in rows.items() if not found] == ["results/by_distance unseen"]
    add_neighbours(maker)
    assert answers(small_lake, study) == rows
    assert study_results(small_lake, study) == before


@pytest.mark.slow
def test_only_the_studys_own_candidates_count(small_lake: Lake, study: str) -> None:
    planners = small_lake.query("results/planners", study=study).to_pylist()
    assert [(row["planner"], row["runs"]) for row in planners] == [("PRM", 6)]  # 2 targets, 3 runs
    (pool,) = study_results(small_lake, study).pools
    assert (pool.targets, pool.candidates, pool.distinct, pool.degenerate) == (2, 6, 6, False)
    # 6 runs of 10, 20 and 30 ms; two selections of 0 s; 2 selections x 2 seeds x 2 kinds of 1.5 s
    assert study_results(small_lake, study).seconds == pytest.approx(
        {"plan_s": 0.06, "timing_s": 0.12, "verify_s": 0.18, "selection_s": 0.0, "train_s": 12.0}
    )


@pytest.mark.slow
def test_the_way_of_the_shortest_is_that_of_the_studys_own_shortest(small_lake: Lake, maker: Any) -> None:
    """The pool's shortest to target 0 is of another planner and another goal configuration."""
    shortest = small_lake.sql(
        "SELECT planner, arg_min(goal_index, joint_movement) AS goal FROM trajectories "
        "WHERE target_id = 0 AND solved AND verified GROUP BY planner ORDER BY min(joint_movement)"
    ).to_pylist()
    own = shortest[-1]
    study = maker.record("own", "cccccccc", planners=[own["planner"]], n_targets=1)
    maker.select(study, "Random", 1, [(0, own["planner"], own["goal"])], n_targets=1)
    maker.test(study, "Random", 1, "BC_MLP", "S")
    (row,) = study_results(small_lake, study).coverage
    assert row.shortest_way == 1.0


@pytest.mark.slow
def test_studies_join_with_what_they_made(small_lake: Lake, maker: Any, study: str) -> None:
    add_neighbours(maker)
    for statement, n in (
        (f"SELECT * FROM studies JOIN selections USING (study) WHERE study = '{study}'", 4),
        (f"SELECT * FROM evaluations JOIN studies USING (study, pool) WHERE study = '{study}'", 28),
        (f"FROM study_trials('{study}')", 28),
        (f"FROM study_candidates('{study}')", 6),
    ):
        assert small_lake.sql(statement).num_rows == n


@pytest.mark.slow
def test_a_name_means_its_last_run_and_a_key_an_earlier_one(small_lake: Lake, maker: Any, study: str) -> None:
    assert find_study(small_lake, "tiny") == study
    add_neighbours(maker)
    assert find_study(small_lake, "tiny") == "tiny-bbbbbbbb"
    assert find_study(small_lake, "tiny", "aaaaaaaa") == find_study(small_lake, study) == study
    maker.record("tiny", "aaaaaaaa", planners=["PRM"], n_targets=2, run_at=datetime(2026, 3, 1, tzinfo=UTC))
    assert find_study(small_lake, "tiny") == study  # it was run again
    with pytest.raises(
        UnknownNameError, match="unknown key of study tiny 'dddddddd': valid are aaaaaaaa, bbbbbbbb"
    ):
        find_study(small_lake, "tiny", "dddddddd")
    with pytest.raises(UnknownNameError, match="unknown study 'tinny': did you mean tiny"):
        find_study(small_lake, "tinny")


def test_a_study_without_trials_says_so(small_lake: Lake, maker: Any) -> None:
    study = maker.record("empty", "aaaaaaaa")
    with pytest.raises(PlancurateError, match="study empty-aaaaaaaa: nothing is tested yet"):
        study_results(small_lake, study)
