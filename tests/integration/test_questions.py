"""Every question of docs/questions.md is answered by a stock DuckDB client on a real study, several of them twice."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import duckdb
import numpy as np
import pandas as pd
import pytest
from scipy import stats

from plancurate.flows.cli.app import main

from .conftest import Studied

PAGE = Path(__file__).parents[2] / "docs" / "questions.md"
QUESTIONS = dict(re.findall(r"^## (\d+)\..*?^```sql\n(.*?)^```$", PAGE.read_text(), re.MULTILINE | re.DOTALL))

Ask = Callable[[str], pd.DataFrame]


@pytest.fixture(scope="module")
def ask(smoke: Studied) -> Ask:
    """Answer of a query by DuckDB alone, which knows nothing but the catalog's path."""
    catalog = smoke.untouched / "lake" / "catalog.duckdb"

    def answer(query: str) -> pd.DataFrame:
        with duckdb.connect(str(catalog), read_only=True) as connection:
            return connection.sql(query).df()

    return answer


def wilson(successes: int, n: int) -> list[float]:
    return list(stats.binomtest(int(successes), int(n)).proportion_ci(method="wilson"))


def test_there_are_fifteen() -> None:
    assert list(QUESTIONS) == [str(number) for number in range(1, 16)]


@pytest.mark.parametrize("number", QUESTIONS)
def test_a_question_has_an_answer(ask: Ask, number: str) -> None:
    assert len(ask(QUESTIONS[number])) > 0


def test_our_own_client_gives_the_same_answer(
    ask: Ask, smoke: Studied, capsys: pytest.CaptureFixture[str]
) -> None:
    for number in ("9", "14"):
        with pytest.raises(SystemExit) as stopped:
            main(("sql", QUESTIONS[number], "--format", "json", "--home", str(smoke.untouched)))
        assert stopped.value.code == 0
        pd.testing.assert_frame_equal(
            pd.DataFrame(json.loads(capsys.readouterr().out)), ask(QUESTIONS[number]), check_dtype=False
        )


def test_planners_are_counted_with_scipys_intervals(ask: Ask) -> None:
    runs = ask("SELECT planner, verified FROM trajectories")
    answer = ask(QUESTIONS["1"]).set_index("planner")
    assert len(answer) == 4
    for planner, own in runs.groupby("planner"):
        row = answer.loc[planner]
        assert [row["runs"], row["usable"]] == [len(own), own["verified"].sum()]
        np.testing.assert_allclose([row["low"], row["high"]], wilson(row["usable"], row["runs"]), atol=1e-9)


def test_planning_times_and_metrics_are_pandas_quantiles(ask: Ask) -> None:
    runs = ask("SELECT planner, plan_s, joint_movement FROM trajectories WHERE verified").groupby("planner")
    times, moves = (ask(QUESTIONS[number]).set_index("planner").sort_index() for number in ("3", "4"))
    np.testing.assert_allclose(times["p95_s"], runs["plan_s"].quantile(0.95))
    np.testing.assert_allclose(moves["joint_movement_rad"], runs["joint_movement"].median())


def test_speeds_and_metrics_follow_from_the_waypoints(ask: Ask) -> None:
    rows = ask("SELECT q, dt, joint_movement FROM trajectories WHERE solved")
    steps = [np.abs(np.diff(np.stack(q).astype(float), axis=0)) for q in rows["q"]]
    fastest = np.max([step.max(axis=0) / dt for step, dt in zip(steps, rows["dt"], strict=True)], axis=0)
    np.testing.assert_allclose(ask(QUESTIONS["5"])["fastest"], fastest)
    off = np.abs([step.sum() for step in steps] - rows["joint_movement"]).max()
    np.testing.assert_allclose(ask(QUESTIONS["6"])["joint_movement_off_rad"], [off], atol=1e-12)
    assert off < 1e-4


def test_copies_are_trajectories_with_equal_bytes(ask: Ask) -> None:
    rows = ask("SELECT target_id, q FROM trajectories WHERE verified")
    distinct = [len({np.stack(q).tobytes() for q in own["q"]}) for _, own in rows.groupby("target_id")]
    assert ask(QUESTIONS["8"])["distinct_found"].tolist() == distinct


def test_results_are_the_trials_counted_in_pandas_with_scipys_intervals(ask: Ask) -> None:
    trials = ask("SELECT selector, policy, success FROM evaluations WHERE kind = 'displaced'")
    counted = trials.groupby(["selector", "policy"])["success"].agg(["sum", "size"])
    rows = ask("FROM results WHERE kind = 'displaced'").set_index(["selector", "policy"]).sort_index()
    assert rows["successes"].tolist() == counted["sum"].tolist()
    assert rows["n"].tolist() == counted["size"].tolist()
    expected = [wilson(k, n) for k, n in zip(counted["sum"], counted["size"], strict=True)]
    np.testing.assert_allclose(rows[["success_low", "success_high"]], expected, atol=1e-9)
    assert rows["success_rate"].between(0, 1, inclusive="neither").any()


def test_a_paired_comparison_is_scipys_binomial_test(ask: Ask) -> None:
    trials = ask("SELECT selector, policy, test_id, success FROM evaluations WHERE kind = 'displaced'")
    wide = trials.pivot(index=["policy", "test_id"], columns="selector", values="success")
    only_one, only_other = (
        (wide["General"] & ~wide["Random"]).sum(),
        (wide["Random"] & ~wide["General"]).sum(),
    )
    row = ask(QUESTIONS["10"]).iloc[0]
    assert [row["trials"], row["only_general"], row["only_random"]] == [len(wide), only_one, only_other]
    np.testing.assert_allclose(row["p"], stats.binomtest(only_one, only_one + only_other).pvalue)


def test_what_selections_share_is_the_intersection_of_their_ids(ask: Ask) -> None:
    kept = ask("SELECT selector, trajectory_id FROM selections").groupby("selector")["trajectory_id"].agg(set)
    one, other = kept["KMeans_Hybrid"], kept["Random"]
    answer = ask(QUESTIONS["14"]).iloc[0]
    assert answer["shared"] == len(one & other)
    assert answer["only_kmeans_hybrid"] == len(one - other)
    np.testing.assert_allclose(answer["jaccard"], len(one & other) / len(one | other))


def test_every_failed_rollout_has_one_reason_and_no_other_has(ask: Ask) -> None:
    answer = ask(QUESTIONS["12"])
    assert answer["failure_reason"].notna().all()
    (counted,) = ask(
        "SELECT count(*) FILTER (NOT success), count(failure_reason) FROM evaluations"
    ).to_numpy()
    assert counted.tolist() == [answer["trials"].sum()] * 2
