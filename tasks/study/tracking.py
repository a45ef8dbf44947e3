"""MLflow: an experiment a study, a parent run a study run, a child run for each policy on each selection.

Runs are named by explicit ids throughout; nothing depends on MLflow's active run or working directory.
MLflow takes seconds to import, so functions import it when they are called.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from plancurate.tasks.study import text
from plancurate.tasks.study.mlflow_models import log_model
from plancurate.tasks.study.mlflow_records import EVALUATION, PARENT, STUDY, ChildRun, StudyRun
from plancurate.tasks.study.mlflow_store import VIEW, open_client

if TYPE_CHECKING:
    from mlflow import MlflowClient

NOTE = "mlflow.note.content"
VIEW_LINK = "#/experiments/{}/runs?viewStateShareKey=results&workflowType=machine_learning"
VIEW_COLUMNS = {
    "params": ("selector", "budget", "policy", "seed"),
    "metrics": ("success_rate", "success_rate_ci_low", "success_rate_ci_high", "settled_rate",
                "final_distance", "path_length", "joint_movement", "selection_time_s", "train_time_s"),
}  # fmt: skip
MAX_NOTE = 5000  # MLflow cuts longer tags of an experiment off in silence


def start_study(
    uri: str, artifacts: Path, name: str, study: str, params: Mapping[str, object], tags: Mapping[str, str]
) -> StudyRun:
    """Open the parent run of `study`, name and key, in the experiment `name`, anew or where it was left."""
    client = open_client(uri)
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
    client = open_client(study.uri)
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
    model_id = log_model(client, study.experiment_id, run_id, child)
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
    client = open_client(study.uri)
    client.log_batch(study.run_id, metrics=_metrics(metrics, None))
    if table:
        client.log_text(study.run_id, table, "results.md")
        client.set_tag(study.run_id, NOTE, _shortened(table))
        link = f"[All runs, best first]({VIEW_LINK.format(study.experiment_id)})"
        client.set_experiment_tag(study.experiment_id, NOTE, _shortened(f"{link}\n\n{table}"))
    client.set_terminated(study.run_id, status)


def log_report(study: StudyRun, folder: Path) -> None:
    """Keep a folder of pages, tables and figures with the parent run."""
    open_client(study.uri).log_artifacts(study.run_id, str(folder), "report")


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


def _shortened(table: str) -> str:
    """The table, cut off between two lines where MLflow would cut it anywhere."""
    if len(table) <= MAX_NOTE:
        return table
    return table[: table.rindex("\n", 0, MAX_NOTE - 40)] + "\n\nAll rows: results.md of this run."
