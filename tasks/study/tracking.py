"""MLflow: an experiment a study, a parent run a study run, a child run for each policy on each selection.

Runs are named by explicit ids throughout; nothing depends on MLflow's active run or working directory.
MLflow takes seconds to import, so functions import it when they are called.
"""

from __future__ import annotations

import fcntl
import json
import logging
import math
import os
import sqlite3
import tempfile
import time
import urllib.error
import urllib.request
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from plancurate.errors import PlancurateError
from plancurate.tasks.curation.names import label
from plancurate.tasks.lake.home import Home
from plancurate.tasks.study import text
from plancurate.tasks.study.artifact_roots import adopt_artifacts

if TYPE_CHECKING:
    from mlflow import MlflowClient

    from plancurate.tasks.motion.served import ServedWorld

NOTE = "mlflow.note.content"
PARENT = "mlflow.parentRunId"
STUDY = "plancurate.study"  # the same identifier as in the lake
EVALUATION = "plancurate.evaluation_id"
VIEW = "mlflow.sharedViewState.results"  # a saved view of the page of runs, opened by a link to its name
VIEW_LINK = "#/experiments/{}/runs?viewStateShareKey=results&workflowType=machine_learning"
VIEW_COLUMNS = {
    "params": ("selector", "budget", "policy", "seed"),
    "metrics": ("success_rate", "success_rate_ci_low", "success_rate_ci_high", "settled_rate",
                "final_distance", "path_length", "joint_movement", "selection_time_s", "train_time_s"),
}  # fmt: skip
MODEL_LOADER = "plancurate.tasks.motion.served"
REQUIREMENTS = ["plancurate"]  # given: working them out would load the model in a process of its own
MAX_NOTE = 5000  # MLflow cuts longer tags of an experiment off in silence
REACH_TIMEOUT_S = 5.0

# Without these MLflow reports its use, asks a slow server for minutes and looks for a uv project to copy.
ENVIRONMENT = {
    "MLFLOW_DISABLE_TELEMETRY": "true",
    "MLFLOW_HTTP_REQUEST_MAX_RETRIES": "2",
    "MLFLOW_HTTP_REQUEST_TIMEOUT": "20",
    "MLFLOW_UV_AUTO_DETECT": "false",
}


@dataclass(frozen=True)
class StudyRun:
    """A parent run; `logged` holds the evaluation ids that have a finished child already."""

    uri: str
    experiment_id: str
    run_id: str
    study: str
    logged: frozenset[str]


@dataclass(frozen=True)
class ChildRun:
    """What one policy, trained on one selection with one seed, gave."""

    evaluation_id: str
    selector: str
    budget: int | None
    policy: str
    seed: int
    params: Mapping[str, object]
    metrics: Mapping[str, float]
    loss_curve: Sequence[tuple[int, float]]
    pool_hash: str
    selection_id: str
    n_kept: int
    model_folder: Path
    world: ServedWorld
    """Where the served model makes motions."""
    example: tuple[float, float, float]
    """A target to ask the served model for, m."""
    tags: Mapping[str, str]

    @property
    def selection(self) -> str:
        """The selection's name: selector and budget."""
        return label(self.selector, self.budget)

    @property
    def name(self) -> str:
        """The run's name, such as `KMeans_Hybrid k=20 BC_RNN seed 0`."""
        return f"{self.selection} {self.policy} seed {self.seed}"


def ensure_store(database: Path) -> str:
    """URI of the MLflow store: `MLFLOW_TRACKING_URI` where it is set, else the SQLite file, made if missing.

    A home that was copied or moved finds its models and artifacts in its own folder from then on.
    Raises PlancurateError for a server that does not answer or a database that this MLflow can't use.
    """
    if configured := os.environ.get("MLFLOW_TRACKING_URI"):
        check_reachable(configured)
        return configured
    database.parent.mkdir(parents=True, exist_ok=True)
    uri = f"sqlite:///{database}"
    from mlflow.exceptions import MlflowException
    from sqlalchemy.exc import SQLAlchemyError

    with database.with_suffix(".lock").open("a") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # two processes that make the tables at once both fail
        try:
            _client(uri)
            adopt_artifacts(database, Home(database.parent).artifacts, VIEW)
        except (MlflowException, SQLAlchemyError, sqlite3.Error) as error:
            reason = " ".join(str(error).split())
            raise PlancurateError(f"{database}: not a database that this MLflow can use: {reason}") from None
    return uri


def start_study(
    uri: str, artifacts: Path, name: str, study: str, params: Mapping[str, object], tags: Mapping[str, str]
) -> StudyRun:
    """Open the parent run of `study`, name and key, in the experiment `name`, anew or where it was left."""
    client = _client(uri)
    experiment_id = _experiment(client, uri, artifacts, name)
    found = client.search_runs([experiment_id], f"attributes.run_name = '{study}'", max_results=1)
    if found:
        run_id = found[0].info.run_id
        client.update_run(run_id, status="RUNNING")
        return StudyRun(uri, experiment_id, run_id, study, _logged(client, experiment_id, run_id))
    run = client.create_run(experiment_id, run_name=study, tags={**tags, STUDY: study})
    client.log_batch(run.info.run_id, params=_params(params))
    return StudyRun(uri, experiment_id, run.info.run_id, study, frozenset())


def log_child(study: StudyRun, child: ChildRun) -> str | None:
    """Record a child run with its model and return its id; None where an earlier study run did so already."""
    if child.evaluation_id in study.logged:
        return None
    client = _client(study.uri)
    facets = {
        "selector": child.selector,
        "budget": text.budget(child.budget),
        "policy": child.policy,
        "seed": str(child.seed),
    }
    tags = {
        **child.tags,
        PARENT: study.run_id,
        STUDY: study.study,
        EVALUATION: child.evaluation_id,
        "plancurate.pool_hash": child.pool_hash,
        "plancurate.selection_id": child.selection_id,
        **facets,
    }
    run = client.create_run(study.experiment_id, run_name=child.name, tags=tags)
    run_id: str = run.info.run_id
    _log_dataset(client, run_id, child)
    model_id = _log_model(client, study.experiment_id, run_id, child)
    metrics = _metrics(child.metrics, model_id) + _curve(child.loss_curve)
    client.log_batch(run_id, metrics=metrics, params=_params({**facets, **child.params}))
    client.set_terminated(run_id)
    return run_id


def finish_study(
    study: StudyRun,
    table: str,
    metrics: Mapping[str, float],
    status: Literal["FINISHED", "FAILED", "KILLED"] = "FINISHED",
) -> None:
    """End the parent run; the results table (Markdown) becomes its description and the experiment's."""
    client = _client(study.uri)
    client.log_batch(study.run_id, metrics=_metrics(metrics, None))
    if table:
        client.log_text(study.run_id, table, "results.md")
        client.set_tag(study.run_id, NOTE, _shortened(table))
        link = f"[All runs, best first]({VIEW_LINK.format(study.experiment_id)})"
        client.set_experiment_tag(study.experiment_id, NOTE, _shortened(f"{link}\n\n{table}"))
    client.set_terminated(study.run_id, status)


def log_report(study: StudyRun, folder: Path) -> None:
    """Keep a folder of pages, tables and figures with the parent run."""
    _client(study.uri).log_artifacts(study.run_id, str(folder), "report")


def _client(uri: str) -> MlflowClient:
    """A client of the store, with MLflow told to keep to itself."""
    for variable, value in ENVIRONMENT.items():
        os.environ.setdefault(variable, value)
    with warnings.catch_warnings():  # importing MLflow's model format warns about MLflow's own type hints
        warnings.simplefilter("ignore")
        import mlflow.pyfunc  # noqa: F401
        from mlflow import MlflowClient

    logging.getLogger("mlflow").setLevel(logging.ERROR)
    logging.getLogger("alembic").setLevel(logging.ERROR)
    return MlflowClient(tracking_uri=uri)


def check_reachable(uri: str) -> None:
    """Raise PlancurateError for the address of an MLflow server that does not answer."""
    if not uri.startswith(("http://", "https://")):
        return
    try:
        urllib.request.urlopen(f"{uri.rstrip('/')}/health", timeout=REACH_TIMEOUT_S).close()
    except urllib.error.HTTPError:
        return  # somebody answers; what it refuses here, the client may be allowed
    except (OSError, ValueError) as error:
        raise PlancurateError(
            f"MLFLOW_TRACKING_URI={uri}: no MLflow server answers there ({getattr(error, 'reason', error)}); "
            "start it, or unset the variable to record in the home folder"
        ) from None


def _experiment(client: MlflowClient, uri: str, artifacts: Path, name: str) -> str:
    """Id of the experiment of that name, made or restored where it is not there."""
    known = client.get_experiment_by_name(name)
    if known is None:
        place = artifacts.absolute().as_uri() if uri.startswith("sqlite:") else None
        tags = {"mlflow.experimentKind": "custom_model_development", VIEW: _view()}
        return str(client.create_experiment(name, artifact_location=place, tags=tags))
    if known.lifecycle_stage == "deleted":
        client.restore_experiment(known.experiment_id)
    return str(known.experiment_id)


def _view() -> str:
    """State of the page of runs that shows the children, best first, with what one compares them by."""
    columns = [f"{kind}.`{name}`" for kind, names in VIEW_COLUMNS.items() for name in names]
    only_children = "metrics.success_rate >= 0"
    order = {"orderByKey": "metrics.`success_rate`", "orderByAsc": False}
    return json.dumps({"searchFilter": only_children, "selectedColumns": columns, **order})


def _logged(client: MlflowClient, experiment_id: str, parent: str) -> frozenset[str]:
    """Evaluation ids with a finished child; children that were cut off are deleted, to be logged again."""
    logged, page = set(), None
    while True:
        found = client.search_runs([experiment_id], f"tags.`{PARENT}` = '{parent}'", page_token=page)
        for run in found:
            if run.info.status == "FINISHED":
                logged.add(run.data.tags.get(EVALUATION, ""))
            else:
                client.delete_run(run.info.run_id)
        page = found.token
        if not page:
            return frozenset(logged)


def _params(values: Mapping[str, object]) -> list[Any]:
    from mlflow.entities import Param

    return [Param(name, str(value)) for name, value in values.items()]


def _metrics(values: Mapping[str, float], model_id: str | None) -> list[Any]:
    from mlflow.entities import Metric

    now = int(time.time() * 1000)
    known = {name: float(value) for name, value in values.items() if math.isfinite(value)}
    return [Metric(name, value, now, 0, model_id=model_id) for name, value in known.items()]


def _curve(losses: Sequence[tuple[int, float]]) -> list[Any]:
    from mlflow.entities import Metric

    now = int(time.time() * 1000)
    return [Metric("train_loss", float(loss), now, step) for step, loss in losses]


def _log_dataset(client: MlflowClient, run_id: str, child: ChildRun) -> None:
    """Say which trajectories the policy saw; our own digest, since MLflow's samples a data frame."""
    from mlflow.entities import Dataset, DatasetInput, InputTag

    identity = {
        "pool_hash": child.pool_hash,
        "selection_id": child.selection_id,
        "trajectories": child.n_kept,
    }
    data = Dataset(
        name=child.selection,
        digest=f"{child.pool_hash}-{child.selection_id.rpartition('-')[2]}",  # MLflow takes 36 characters
        source_type="plancurate lake",
        source=json.dumps(identity),
        profile=json.dumps(identity),
    )
    client.log_inputs(run_id, [DatasetInput(data, [InputTag("mlflow.data.context", "training")])])


def _log_model(client: MlflowClient, experiment_id: str, run_id: str, child: ChildRun) -> str:
    """Store the policy with its world as an MLflow model: files and the name of the module that loads them."""
    import mlflow.pyfunc
    import numpy as np
    from mlflow.entities import LoggedModelOutput, LoggedModelStatus
    from mlflow.models import Model, ModelSignature
    from mlflow.types import Schema, TensorSpec

    from plancurate.tasks.motion.served import save_served

    # Targets or observations in; what comes out for a target is no tensor.
    signature = ModelSignature(inputs=Schema([TensorSpec(np.dtype(np.float64), (-1, -1))]))
    model = client.create_logged_model(
        experiment_id, name=child.policy, source_run_id=run_id, tags={"selection": child.selection}
    )
    with tempfile.TemporaryDirectory() as folder:
        path, served = str(Path(folder) / "model"), Path(folder) / "served"
        save_served(served, child.model_folder, child.world)
        mlflow.pyfunc.save_model(
            path,
            loader_module=MODEL_LOADER,
            data_path=str(served),
            mlflow_model=Model(run_id=run_id, model_id=model.model_id),
            signature=signature,
            input_example=np.array([child.example]),
            pip_requirements=REQUIREMENTS,
        )
        client.log_model_artifacts(model.model_id, path)
    client.finalize_logged_model(model.model_id, LoggedModelStatus.READY)
    client.log_outputs(run_id, [LoggedModelOutput(model.model_id, step=0)])
    return str(model.model_id)


def _shortened(table: str) -> str:
    """The table, cut off between two lines where MLflow would cut it anywhere."""
    if len(table) <= MAX_NOTE:
        return table
    return table[: table.rindex("\n", 0, MAX_NOTE - 40)] + "\n\nAll rows: results.md of this run."
