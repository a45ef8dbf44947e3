"""MLflow: an experiment a study name, a parent run a study, below it a run a selection, below that one a network.

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
from plancurate.tasks.study.mlflow_models import log_dataset, log_model
from plancurate.tasks.study.mlflow_records import EVALUATION, PARENT, SELECTION, STUDY, ChildRun, StudyRun
from plancurate.tasks.study.mlflow_store import VIEW, is_server, open_client

if TYPE_CHECKING:
    from mlflow import MlflowClient


NOTE = "mlflow.note.content"
VIEW_LINK = "#/experiments/{}/runs?viewStateShareKey=results&workflowType=machine_learning"
VIEW_METRICS = ("success_rate", "success_low", "success_high")
VIEW_PARAMS = ("selector", "policy")  # no more than a page shows at once; a run's name has the rest
SECTION = "success"
MAX_NOTE = 5000  # MLflow cuts longer tags of an experiment off in silence


def start_study(
    uri: str,
    artifacts: Path,
    name: str,
    study: str,
    params: Mapping[str, object],
    tags: Mapping[str, str],
    selections: Mapping[str, Mapping[str, str]],
) -> StudyRun:
    """Open the parent run of `study`, name and key, in the experiment `name`, anew or where it was left.

    selections: parameters of each selection's run by its title.
    """
    client = open_client(uri)
    experiment_id = _experiment(client, uri, artifacts, name)
    found = client.search_runs([experiment_id], f"attributes.run_name = '{study}'", max_results=1)
    if found:
        run_id = found[0].info.run_id
        client.update_run(run_id, status="RUNNING")
    else:
        run_id = client.create_run(experiment_id, run_name=study, tags={**tags, STUDY: study}).info.run_id
        client.log_batch(run_id, params=_params(params))
    logged, opened = _below(client, experiment_id, study)
    for title in selections.keys() - opened.keys():
        own = {STUDY: study, PARENT: run_id, SELECTION: title}
        opened[title] = client.create_run(experiment_id, run_name=title, tags=own).info.run_id
        client.log_batch(opened[title], params=_params(selections[title]))
    return StudyRun(uri, experiment_id, run_id, study, logged, opened)


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
        PARENT: study.selections[child.selection_title],
        STUDY: study.study,
        EVALUATION: child.evaluation_id,
        "plancurate.pool_hash": child.pool_hash,
        "plancurate.selection_id": child.selection_id,
        **facets,
    }
    run = client.create_run(study.experiment_id, run_name=child.name, tags=tags)
    run_id: str = run.info.run_id
    log_dataset(client, run_id, child)
    model_id = log_model(client, study.experiment_id, run_id, child)
    metrics = _metrics(child.metrics, model_id) + _curve(child.loss_curve)
    client.log_batch(run_id, metrics=metrics, params=_params({**facets, **child.params}))
    client.set_terminated(run_id)
    return run_id


def finish_study(
    study: StudyRun,
    table: str,
    metrics: Mapping[str, float],
    selections: Mapping[str, Mapping[str, float]],
    status: Literal["FINISHED", "FAILED", "KILLED"] = "FINISHED",
) -> None:
    """End the parent run and those of selections, with metrics of each.

    The verdict with the results table (Markdown) becomes the parent's description and the experiment's.
    """
    client = open_client(study.uri)
    for title, values in selections.items():
        client.log_batch(study.selections[title], metrics=_metrics(values, None))
        client.set_terminated(study.selections[title], status)
    client.log_batch(study.run_id, metrics=_metrics(metrics, None))
    if table:
        client.log_text(study.run_id, table, "results.md")
        client.set_tag(study.run_id, NOTE, _shortened(table, MAX_NOTE))
        verdict, _, rows = table.partition("\n\n")
        link = f"[All runs, best first]({VIEW_LINK.format(study.experiment_id)})"
        head = f"{_shortened(verdict, MAX_NOTE - len(link) - 2)}\n\n{link}"
        note = _shortened(f"{head}\n\n{rows}", MAX_NOTE) if rows else head
        client.set_experiment_tag(study.experiment_id, NOTE, note)
    client.set_terminated(study.run_id, status)


def log_report(study: StudyRun, folder: Path) -> None:
    """Keep a folder of pages, tables and figures with the parent run."""
    open_client(study.uri).log_artifacts(study.run_id, str(folder), "report")


def _experiment(client: MlflowClient, uri: str, artifacts: Path, name: str) -> str:
    """Id of the experiment of that name, made or restored where it is not there."""
    known = client.get_experiment_by_name(name)
    if known is None:
        place = artifacts.absolute().as_uri() if not is_server(uri) else None
        tags = {"mlflow.experimentKind": "custom_model_development", VIEW: _view()}
        return str(client.create_experiment(name, artifact_location=place, tags=tags))
    if known.lifecycle_stage == "deleted":
        client.restore_experiment(known.experiment_id)
    return str(known.experiment_id)


def _view() -> str:
    """State of the page of runs that shows the children, best first, as a table and as charts."""
    state = {
        "searchFilter": "metrics.success_rate >= 0",  # only the children have it
        "orderByKey": "metrics.`success_rate`",
        "orderByAsc": False,
        "selectedColumns": [f"metrics.`{name}`" for name in VIEW_METRICS]
        + [f"params.`{name}`" for name in VIEW_PARAMS],
        "runsVisibilityMode": "SHOWALL",
        "compareRunSections": [{"uuid": SECTION, "name": "Success", "display": True, "isReordered": False}],
        "compareRunCharts": [
            _chart(
                "PARALLEL",
                "by-selector",
                selectedParams=VIEW_PARAMS,
                selectedMetrics=["success_rate"],
                showAllRuns=True,
            ),
            *(_chart("BAR", name, metricKey=name, runsCountToCompare=20) for name in VIEW_METRICS),
        ],
    }
    return json.dumps(state)


def _chart(kind: str, name: str, **what: Any) -> dict[str, Any]:
    place = {"uuid": name, "metricSectionId": SECTION, "deleted": False, "isGenerated": False}
    return {"type": kind, **place, **what}


def _below(client: MlflowClient, experiment_id: str, study: str) -> tuple[frozenset[str], dict[str, str]]:
    """Evaluation ids with a finished run and ids of the selections' runs; networks that were cut off are deleted."""
    logged, selections, page = set(), {}, None
    while True:
        found = client.search_runs([experiment_id], f"tags.`{STUDY}` = '{study}'", page_token=page)
        for run in found:
            tags = run.data.tags
            if SELECTION in tags:
                selections[tags[SELECTION]] = run.info.run_id
            elif EVALUATION in tags and run.info.status == "FINISHED":
                logged.add(tags[EVALUATION])
            elif EVALUATION in tags:
                client.delete_run(run.info.run_id)
        page = found.token
        if not page:
            return frozenset(logged), selections


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


def _shortened(table: str, length: int) -> str:
    """The table, cut off between two lines where MLflow would cut it anywhere."""
    if len(table) <= length:
        return table
    return table[: table.rindex("\n", 0, length - 40)] + "\n\nAll rows: results.md of this run."
