"""MLflow tracking on a real SQLite store."""

from __future__ import annotations

import json
import math
import re
import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from plancurate.errors import PlancurateError
from plancurate.robots import load_world
from plancurate.tasks.learning.policies import Normaliser, TrainedPolicy, make_policy
from plancurate.tasks.motion.predict import PredictSettings
from plancurate.tasks.motion.served import ServedWorld
from plancurate.tasks.study import mlflow_store, tracking
from plancurate.tasks.study.mlflow_models import champion, set_champion
from plancurate.tasks.study.mlflow_records import ChildRun, StudyRun

pytestmark = pytest.mark.server

DOF = 6
WORLD = ServedWorld(
    "h2017", "free", tuple(one.digest for one in load_world("h2017", "free")), PredictSettings(proposals=1)
)
SELECTIONS = {"KMeans_Hybrid k=20": {"selector": "KMeans_Hybrid", "budget": "20", "policy": "all"}}


@pytest.fixture(scope="session")
def empty_store(tables: Path) -> Path:
    """A database with MLflow's tables."""
    return tables / "mlflow.db"


@pytest.fixture(scope="session")
def model_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    policy = make_policy("BC_RNN", {})
    ones = Normaliser(torch.zeros(3 + DOF), torch.ones(3 + DOF), torch.zeros(DOF), torch.ones(DOF))
    weights = policy.initial(3 + DOF, DOF, torch.Generator().manual_seed(0))
    folder = tmp_path_factory.mktemp("policy")
    layout = (("target_offset", 3), ("joint_positions", DOF))
    TrainedPolicy(policy, weights, ones, layout, "delta", window=10, seed=0).save(folder)
    return folder


@pytest.fixture
def begin(empty_store: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., StudyRun]:
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    shutil.copy(empty_store, tmp_path / "mlflow.db")
    uri = mlflow_store.ensure_store(tmp_path / "mlflow.db")

    def start(key: str = "k1") -> StudyRun:
        return tracking.start_study(
            uri, tmp_path / "artifacts", "quick", key, {"n_targets": 5}, {"robot": "h2017"}, SELECTIONS
        )

    return start


@pytest.fixture
def child(model_folder: Path) -> ChildRun:
    return ChildRun(
        evaluation_id="e1",
        study_name="quick",
        selection_title="KMeans_Hybrid k=20",
        selector="KMeans_Hybrid",
        budget=20,
        policy="BC_RNN",
        seed=0,
        params={"training.steps": 200},
        metrics={"success_rate": 0.95, "success_low": 0.88, "success_high": 0.98},
        loss_curve=[(100, 0.5), (200, 0.25)],
        pool_hash="0123456789ab",
        selection_id="KMeans_Hybrid-k20-s0-fedcba987654",
        n_kept=100,
        model_folder=model_folder,
        world=WORLD,
        example=(0.9, 0.1, 0.6),
        tags={"robot": "h2017"},
    )


def below(study: StudyRun, run_id: str) -> list:
    from mlflow import MlflowClient

    client = MlflowClient(study.uri)
    return list(client.search_runs([study.experiment_id], f"tags.`mlflow.parentRunId` = '{run_id}'"))


def children(study: StudyRun) -> list:
    """The networks' runs."""
    return below(study, study.selections["KMeans_Hybrid k=20"])


def test_a_child_run_says_what_it_is_and_what_came_out(
    begin: Callable[..., StudyRun], child: ChildRun
) -> None:
    study = begin()
    run_id = tracking.log_child(study, child)
    (run,) = children(study)
    assert run.info.run_id == run_id
    assert run.info.status == "FINISHED"
    assert run.info.run_name == "KMeans_Hybrid k=20 BC_RNN seed 0"
    assert run.data.params == {
        "selector": "KMeans_Hybrid", "budget": "20", "policy": "BC_RNN", "seed": "0", "training.steps": "200",
    }  # fmt: skip
    assert run.data.metrics == {**child.metrics, "train_loss": 0.25}
    (data,) = run.inputs.dataset_inputs
    assert (data.dataset.name, data.dataset.digest) == ("KMeans_Hybrid k=20", "0123456789ab-fedcba987654")
    assert "KMeans_Hybrid-k20-s0-fedcba987654" in data.dataset.source


def test_a_selection_has_a_run_with_its_interval_above_those_of_its_networks(
    begin: Callable[..., StudyRun], child: ChildRun
) -> None:
    study = begin()
    tracking.log_child(study, child)
    rates = {"success_rate": 0.9, "success_low": 0.8, "success_high": 0.95}
    tracking.finish_study(study, "verdict", {}, {"KMeans_Hybrid k=20": rates})
    (selection,) = below(study, study.run_id)
    assert (selection.info.run_name, selection.info.status) == ("KMeans_Hybrid k=20", "FINISHED")
    assert selection.data.metrics == rates
    assert selection.data.params == {"selector": "KMeans_Hybrid", "budget": "20", "policy": "all"}
    assert [run.info.run_name for run in below(study, selection.info.run_id)] == [
        "KMeans_Hybrid k=20 BC_RNN seed 0"
    ]
    assert begin().selections == {"KMeans_Hybrid k=20": selection.info.run_id}


def test_the_loss_curve_is_kept_step_by_step(begin: Callable[..., StudyRun], child: ChildRun) -> None:
    from mlflow import MlflowClient

    study = begin()
    run_id = tracking.log_child(study, child)
    history = MlflowClient(study.uri).get_metric_history(run_id, "train_loss")
    assert [(metric.step, metric.value) for metric in history] == child.loss_curve


def test_the_logged_model_predicts_without_unpickling_anything(
    begin: Callable[..., StudyRun], child: ChildRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    import mlflow.pyfunc

    study = begin()
    tracking.log_child(study, child)
    (run,) = children(study)
    (output,) = run.outputs.model_outputs
    monkeypatch.setenv("MLFLOW_ALLOW_PICKLE_DESERIALIZATION", "false")
    monkeypatch.setenv("MLFLOW_TRACKING_URI", study.uri)
    model = mlflow.pyfunc.load_model(f"models:/{output.model_id}")
    answer = model.predict(np.zeros((4, 3 + DOF)))
    assert answer.shape == (4, DOF)
    assert np.isfinite(answer).all()


def test_a_champion_is_an_alias_of_a_version_that_copies_nothing(
    begin: Callable[..., StudyRun], child: ChildRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import mlflow.pyfunc

    study = begin()
    for number in (1, 2):
        tracking.log_child(study, replace(child, evaluation_id=f"e{number}", seed=number))
    before = sorted(tmp_path.rglob("artifacts/**/*"))
    assert champion(study.uri, "quick-BC_RNN") is None
    for number in (1, 2):
        set_champion(study, "quick-BC_RNN", f"e{number}", "better")
        assert champion(study.uri, "quick-BC_RNN") == f"e{number}"
    assert champion(study.uri, "quick-BC_MLP") is None
    assert sorted(tmp_path.rglob("artifacts/**/*")) == before
    monkeypatch.setenv("MLFLOW_TRACKING_URI", study.uri)
    assert mlflow.pyfunc.load_model("models:/quick-BC_RNN@champion").predict(
        np.zeros((1, 3 + DOF))
    ).shape == (1, DOF)


def test_a_model_is_called_by_study_selector_budget_and_policy(
    begin: Callable[..., StudyRun], child: ChildRun
) -> None:
    from mlflow import MlflowClient

    study = begin()
    tracking.log_child(study, child)
    shares = {"study_name": "v1.2", "selector": "Mine(share=0.2)", "budget": None, "evaluation_id": "e2"}
    tracking.log_child(study, replace(child, **shares))
    models = MlflowClient(study.uri).search_logged_models([study.experiment_id])
    assert {model.name for model in models} == {
        "quick-KMeans_Hybrid-k20-BC_RNN",
        "v1_2-Mine(share=0_2)-all-BC_RNN",
    }


def test_a_study_taken_up_again_repeats_no_child(begin: Callable[..., StudyRun], child: ChildRun) -> None:
    first = begin()
    tracking.log_child(first, child)
    tracking.finish_study(first, "| selector |", {}, {})
    again = begin()
    assert again.run_id == first.run_id
    assert again.logged == {"e1"}
    assert tracking.log_child(again, child) is None
    tracking.log_child(again, replace(child, evaluation_id="e2", seed=1))
    assert sorted(run.data.tags["plancurate.evaluation_id"] for run in children(again)) == ["e1", "e2"]


def test_a_child_that_was_cut_off_is_logged_again(begin: Callable[..., StudyRun], child: ChildRun) -> None:
    study = begin()
    tracking.log_child(study, child)
    (run,) = children(study)
    from mlflow import MlflowClient

    MlflowClient(study.uri).update_run(run.info.run_id, status="RUNNING")  # as kill -9 leaves it
    again = begin()
    assert again.logged == frozenset()
    tracking.log_child(again, child)
    assert [run.info.status for run in children(again)] == ["FINISHED"]


def test_another_configuration_is_another_parent_of_one_experiment(begin: Callable[..., StudyRun]) -> None:
    first, second = begin("k1"), begin("k2")
    assert first.experiment_id == second.experiment_id
    assert first.run_id != second.run_id


def test_the_results_table_becomes_the_description(begin: Callable[..., StudyRun]) -> None:
    from mlflow import MlflowClient

    study = begin()
    tracking.finish_study(study, "| selector | success |\n|---|---|", {"best_success_rate": 0.9}, {})
    client = MlflowClient(study.uri)
    run = client.get_run(study.run_id)
    assert run.info.status == "FINISHED"
    assert run.data.tags["mlflow.note.content"].startswith("| selector")
    assert client.get_experiment(study.experiment_id).tags["mlflow.note.content"].startswith("| selector")
    assert run.data.metrics == {"best_success_rate": 0.9}


def test_the_experiment_links_to_a_view_of_its_runs_whose_columns_exist(
    begin: Callable[..., StudyRun], child: ChildRun
) -> None:
    from mlflow import MlflowClient

    study = begin()
    tracking.log_child(study, replace(child, metrics=dict.fromkeys(tracking.VIEW_METRICS, 0.5)))
    tracking.finish_study(study, "the verdict\n\nthe table", {}, {})
    tags = MlflowClient(study.uri).get_experiment(study.experiment_id).tags
    (shared,) = re.findall(r"viewStateShareKey=(\w+)", tags["mlflow.note.content"])
    view = json.loads(tags[f"mlflow.sharedViewState.{shared}"])
    (run,) = MlflowClient(study.uri).search_runs([study.experiment_id], view["searchFilter"])
    logged = {f"params.`{name}`" for name in run.data.params} | {
        f"metrics.`{name}`" for name in run.data.metrics
    }
    charted = {
        f"metrics.`{chart['metricKey']}`" for chart in view["compareRunCharts"] if "metricKey" in chart
    }
    assert {view["orderByKey"], *view["selectedColumns"], *charted} <= logged
    assert re.fullmatch(r"the verdict\n\n\[.*\]\(.*\)\n\nthe table", tags["mlflow.note.content"])


def test_a_long_table_is_cut_between_lines_and_kept_whole_as_a_file(
    begin: Callable[..., StudyRun], tmp_path: Path
) -> None:
    from mlflow import MlflowClient

    study = begin()
    table = "\n".join(f"| row {i:04d} |" for i in range(1000))
    tracking.finish_study(study, table, {}, {})
    client = MlflowClient(study.uri)
    note = client.get_run(study.run_id).data.tags["mlflow.note.content"]
    assert len(note) <= tracking.MAX_NOTE
    assert len(client.get_experiment(study.experiment_id).tags["mlflow.note.content"]) <= tracking.MAX_NOTE
    assert set(note.split("\n\n")[0].split("\n")) <= set(table.split("\n"))
    assert Path(client.download_artifacts(study.run_id, "results.md", str(tmp_path))).read_text() == table


def test_a_measure_that_is_missing_is_not_logged(begin: Callable[..., StudyRun], child: ChildRun) -> None:
    study = begin()
    tracking.log_child(study, replace(child, metrics={"success_rate": 0.0, "final_distance": math.nan}))
    (run,) = children(study)
    assert run.data.metrics == {"success_rate": 0.0, "train_loss": 0.25}


def test_a_deleted_experiment_is_restored(begin: Callable[..., StudyRun]) -> None:
    from mlflow import MlflowClient

    study = begin()
    MlflowClient(study.uri).delete_experiment(study.experiment_id)
    assert begin("k2").experiment_id == study.experiment_id


def test_a_server_that_does_not_answer_is_said_in_one_line(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("MLFLOW_TRACKING_URI", "http://127.0.0.1:9")
    with pytest.raises(
        PlancurateError, match=r"MLFLOW_TRACKING_URI=http://127\.0\.0\.1:9: no MLflow server answers"
    ):
        mlflow_store.ensure_store(tmp_path / "mlflow.db")
    assert not list(tmp_path.iterdir())


def test_a_file_that_is_no_database_is_said_in_one_line(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    (tmp_path / "mlflow.db").write_text("not a database, but long enough to be taken for one" * 100)
    with pytest.raises(
        PlancurateError, match=r"mlflow\.db: not a database that this MLflow can use"
    ) as caught:
        mlflow_store.ensure_store(tmp_path / "mlflow.db")
    assert "\n" not in str(caught.value)


def test_processes_that_start_at_once_all_get_a_store(tmp_path: Path) -> None:
    code = (
        "import pathlib, plancurate.tasks.study.mlflow_store as m; m.ensure_store(pathlib.Path('mlflow.db'))"
    )
    command = [sys.executable, "-c", code]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    started = [subprocess.Popen(command, cwd=tmp_path, **pipes) for _ in range(2)]
    said = [process.communicate()[0].decode() for process in started]
    assert [process.returncode for process in started] == [0, 0], said
    assert said == ["", ""]


def test_a_copied_home_finds_its_models_and_artifacts_when_the_original_is_gone(
    empty_store: Path, child: ChildRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import mlflow.pyfunc
    from mlflow import MlflowClient

    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    original, copy = tmp_path / "home", tmp_path / "a copy"
    original.mkdir()
    shutil.copy(empty_store, original / "mlflow.db")
    uri = mlflow_store.ensure_store(original / "mlflow.db")
    client = MlflowClient(uri)
    elsewhere = client.create_experiment("mine", artifact_location=f"file://{tmp_path}/mine/artifacts")
    study = tracking.start_study(uri, original / "artifacts", "quick", "k1", {}, {}, SELECTIONS)
    run_id = tracking.log_child(study, child)
    assert run_id is not None
    tracking.finish_study(study, "| a |", {}, {})
    model_id = client.get_run(run_id).outputs.model_outputs[0].model_id
    set_champion(study, "policy", "e1", "the first")
    shutil.copytree(original, copy)
    shutil.rmtree(original)

    uri = mlflow_store.ensure_store(copy / "mlflow.db")
    client = MlflowClient(uri)
    assert Path(client.download_artifacts(study.run_id, "results.md")).read_text() == "| a |"
    assert [file.path for file in client.list_artifacts(study.run_id)] == ["results.md"]
    monkeypatch.setenv("MLFLOW_TRACKING_URI", uri)
    for name in (f"models:/{model_id}", "models:/policy/1", "models:/policy@champion"):
        assert mlflow.pyfunc.load_model(name).predict(np.zeros((1, 3 + DOF))).shape == (1, DOF)
    monkeypatch.delenv("MLFLOW_TRACKING_URI")
    assert client.get_experiment(elsewhere).artifact_location == f"file://{tmp_path}/mine/artifacts"
    with closing(sqlite3.connect(copy / "mlflow.db")) as database:
        assert not [line for line in database.iterdump() if str(original) in line]
    again = tracking.start_study(uri, copy / "artifacts", "quick", "k2", {}, {}, SELECTIONS)
    assert client.get_run(again.run_id).info.artifact_uri.startswith((copy / "artifacts").as_uri())


def test_opening_a_home_where_it_was_made_writes_nothing_to_its_database(
    begin: Callable[..., StudyRun], tmp_path: Path
) -> None:
    begin()
    before = (tmp_path / "mlflow.db").read_bytes()
    mlflow_store.ensure_store(tmp_path / "mlflow.db")
    assert (tmp_path / "mlflow.db").read_bytes() == before
