"""The whole way on the smoke preset: what it prints, what it leaves, what doing it again does."""

from __future__ import annotations

import csv
import io
import json
import os
import shlex
import sqlite3
import subprocess
from collections import Counter
from pathlib import Path

import pytest

from plancurate import sql
from plancurate.tasks.lake.home import Home
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study.config import load_config
from plancurate.tasks.study.context import open_study
from plancurate.tasks.study.exclusive import exclusive
from plancurate.tasks.study.rows import REPORT_FIELDS
from plancurate.tasks.study.statistics import wilson_interval

from .conftest import Command, Studied

SMOKE = load_config("smoke", None, {})
STUDY = open_study(SMOKE, Home(Path("nowhere"))).study


def parts(home: Path) -> dict[str, int]:
    return {str(path): path.stat().st_mtime_ns for path in (home / "lake").rglob("part-*.parquet")}


def test_a_study_ends_in_a_verdict_and_a_table_of_every_selector(smoke: Studied) -> None:
    for selector in (choice.label for choice in SMOKE.selectors):
        assert selector in smoke.stdout
    assert "General, which keeps every candidate" in " ".join(smoke.stdout.split())
    assert "[95 % over targets only]" in smoke.stdout
    assert str(smoke.home / "reports" / STUDY) in smoke.stdout
    assert max(map(len, smoke.stdout.splitlines()[:-5])) <= 80


def test_a_study_is_quiet(smoke: Studied) -> None:
    said = smoke.stdout + smoke.stderr
    for noise in ("Traceback", "Warning", "WARN", "nanobind", "INFO", "ERROR", "pybullet build"):
        assert noise not in said, said
    assert len(smoke.stderr.splitlines()) <= 8


def test_a_report_has_a_row_for_every_selector_and_policy(smoke: Studied, plancurate: Command) -> None:
    done = plancurate("report", "--study", "smoke", "--format", "json", "--home", str(smoke.home))
    rows = json.loads(done.stdout)
    found = {(row["selector"], row["policy"]) for row in rows}
    assert found == {(s, p) for s in (c.label for c in SMOKE.selectors) for p in SMOKE.policies}
    for row in rows:
        assert tuple(row) == REPORT_FIELDS
        assert row["n"] == 16 * SMOKE.n_targets
        interval = wilson_interval(row["successes"], row["n"])
        assert (row["ci_low"], row["ci_high"]) == pytest.approx((interval.low, interval.high))


def test_a_report_in_markdown_has_the_same_rows(smoke: Studied, plancurate: Command) -> None:
    done = plancurate("report", "--study", "smoke", "--home", str(smoke.home))
    lines = done.stdout.strip().splitlines()
    assert lines[0].startswith("| selector | budget | policy |")
    assert len(lines) == 2 + len(SMOKE.selectors) * len(SMOKE.policies)


def test_the_lake_answers_sql_as_table_csv_and_json(smoke: Studied, plancurate: Command) -> None:
    query = "SELECT planner, count(*) AS runs FROM trajectories GROUP BY planner ORDER BY planner"
    home = ("--home", str(smoke.home))
    expected = dict.fromkeys(SMOKE.planners, 3 * SMOKE.n_targets)
    as_csv = list(csv.DictReader(io.StringIO(plancurate("sql", query, "--format", "csv", *home).stdout)))
    assert {row["planner"]: int(row["runs"]) for row in as_csv} == expected
    as_json = json.loads(plancurate("sql", query, "--format", "json", *home).stdout)
    assert {row["planner"]: row["runs"] for row in as_json} == expected
    assert "RRTConnect" in plancurate("sql", query, *home).stdout


def test_every_check_of_the_lake_finds_nothing(smoke: Studied) -> None:
    lake = Lake(smoke.home / "lake")
    for name in sql.names("audits"):
        assert lake.query(name).num_rows == 0, name


def test_every_smoke_planner_solves_every_run(smoke: Studied) -> None:
    rows = Lake(smoke.home / "lake").sql("SELECT trajectory_id, reason FROM trajectories WHERE NOT solved")
    assert rows.to_pylist() == []


def test_doing_a_study_again_changes_nothing_in_the_lake(smoke: Studied, plancurate: Command) -> None:
    before = parts(smoke.home)
    again = plancurate("study", "--preset", "smoke", "--home", str(smoke.home))
    assert again.returncode == 0, again.stderr
    assert parts(smoke.home) == before
    assert again.stdout == smoke.stdout


def test_a_study_that_another_process_works_on_is_left_alone(
    smoke: Studied, plancurate_on_shared_server: Command
) -> None:
    home = Home.resolve(smoke.home)
    with exclusive(home, open_study(SMOKE, home).study):
        second = plancurate_on_shared_server("study", "--preset", "smoke", "--home", str(smoke.home))
    assert second.returncode == 2
    assert f"process {os.getpid()} is at work on it" in second.stderr
    assert "Traceback" not in second.stderr


def test_a_larger_study_reuses_what_is_there(smoke: Studied, plancurate_on_shared_server: Command) -> None:
    before = parts(smoke.home)
    words = ("generate", "--preset", "smoke", "--targets", "3", "--planners", "RRTConnect", "EST")
    done = plancurate_on_shared_server(*words, "--home", str(smoke.home))
    assert done.returncode == 0, done.stderr
    after = parts(smoke.home)
    assert before.items() <= after.items()
    planned = Lake(smoke.home / "lake").sql("SELECT DISTINCT planner, target_id FROM trajectories")
    new = {(row["planner"], row["target_id"]) for row in planned.to_pylist()} - {
        (planner, target) for planner in SMOKE.planners for target in range(2)
    }
    assert new == {("RRTConnect", 2), ("EST", 0), ("EST", 1), ("EST", 2)}


def test_prefect_recorded_every_task_run_that_was_executed(smoke: Studied) -> None:
    with sqlite3.connect(smoke.untouched / "prefect" / "prefect.db") as database:
        runs = database.execute("SELECT name, state_type FROM task_run").fetchall()
    assert {state for _, state in runs} == {"COMPLETED"}
    names = sorted(name for name, _ in runs)
    planned = [f"plan {planner} target {target:04d}" for planner in SMOKE.planners for target in range(2)]
    assert [name for name in names if name.startswith("plan ")] == sorted(planned)
    assert [name for name in names if name.startswith(("label ", "sample "))] == [
        "label targets 000000-000001",
        "sample targets",
    ]
    stages = Counter(name.split()[0] for name in names)
    assert (stages["curate"], stages["references"], stages["audit"]) == (len(SMOKE.selectors), 1, 1)


def test_no_process_outlives_a_command(smoke: Studied) -> None:
    left = subprocess.run(["pgrep", "-f", str(smoke.home)], capture_output=True, text=True, check=False)
    assert left.stdout == ""


def test_a_model_loads_with_mlflow_and_without_unpickling(
    smoke: Studied, monkeypatch: pytest.MonkeyPatch
) -> None:
    import pickle

    import mlflow
    import numpy as np

    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("something was unpickled")

    client = mlflow.MlflowClient(f"sqlite:///{smoke.home / 'mlflow.db'}")
    experiment = client.get_experiment_by_name("smoke")
    assert experiment is not None
    children = [
        run
        for run in client.search_runs([experiment.experiment_id], max_results=1000)
        if "plancurate.evaluation_id" in run.data.tags
    ]
    assert len(children) == len(SMOKE.selectors) * len(SMOKE.policies)
    run = next(run for run in children if run.info.run_name.startswith("KMeans_Hybrid k=2 BC_RNN seed"))
    for name in (
        "success_rate",
        "success_low",
        "settled_high",
        "selection_time_s",
        "train_time_s",
    ):
        assert name in run.data.metrics
    assert len(client.get_metric_history(run.info.run_id, "train_loss")) > 10
    model_id = run.outputs.model_outputs[0].model_id
    folder = Path(client.get_logged_model(model_id).artifact_location.removeprefix("file://"))
    monkeypatch.setattr(pickle, "load", refuse)
    monkeypatch.setattr(pickle, "loads", refuse)
    model = mlflow.pyfunc.load_model(str(folder))
    answer = model.predict(np.zeros((4, 9)))
    assert np.asarray(answer).shape == (4, 6)
    (motion,) = model.predict(np.array([[0.9, 0.1, 0.6]]))
    assert motion["verdict"]["passed"]
    assert np.shape(motion["motion"]["positions"])[1] == 6


def test_a_study_leaves_a_page_whose_numbers_the_lake_gives_again(
    smoke: Studied, plancurate: Command
) -> None:
    from mlflow import MlflowClient

    folder = smoke.home / "reports" / STUDY
    text = (folder / "index.html").read_text()
    for selector in (choice.label for choice in SMOKE.selectors):
        assert selector in text
    assert text.count('href="data:image/png') == 7  # a scene; two trajectories, selections and rollouts
    assert "Not shown" not in text
    assert len(text) < 2_000_000
    assert (folder / "report.md").read_text().startswith("# Study smoke\n")
    first = json.loads((folder / "report.json").read_text())["tables"][0]
    counts = {(row["selector"], row["budget"], row["n"], row["successes"]) for row in first["rows"]}
    words = shlex.split(first["commands"][0])
    done = plancurate(*words[1:], "--format", "json", "--home", str(smoke.home))
    rows = json.loads(done.stdout)
    assert {(row["selector"], row["budget"], row["n"], row["successes"]) for row in rows} == counts

    client = MlflowClient(f"sqlite:///{smoke.home / 'mlflow.db'}")
    experiment = client.get_experiment_by_name("smoke")
    assert experiment is not None
    (parent,) = client.search_runs([experiment.experiment_id], "tags.study = 'smoke'")
    kept = {file.path for file in client.list_artifacts(parent.info.run_id, "report/figures")}
    assert kept == {f"report/figures/{file.name}" for file in (folder / "figures").iterdir()}


def test_a_report_is_written_again_on_demand(smoke: Studied, plancurate: Command) -> None:
    page = smoke.home / "reports" / STUDY / "index.html"
    before = page.read_text()
    page.unlink()
    done = plancurate("report", "--study", "smoke", "--format", "json", "--home", str(smoke.home))
    assert done.stderr.strip() == f"report {page}"
    assert page.read_text() == before


def test_every_candidate_of_a_study_has_its_way(smoke: Studied) -> None:
    ways = Lake(smoke.home / "lake").sql(f"SELECT way FROM study_candidates('{STUDY}') WHERE verified")
    assert ways.num_rows == 24
    assert None not in ways["way"].to_pylist()
    assert "goal configurations and" in smoke.stderr
