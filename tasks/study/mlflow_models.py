"""Policies as MLflow's models with the data that they saw, and the registered ones that are a study's champions.

MLflow takes seconds to import, so functions import it when they are called.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from plancurate.tasks.study.mlflow_records import EVALUATION, STUDY, ChildRun, StudyRun
from plancurate.tasks.study.mlflow_store import is_server, open_client

if TYPE_CHECKING:
    from mlflow import MlflowClient

CHAMPION = "champion"
MODEL_LOADER = "plancurate.tasks.motion.served"
REQUIREMENTS = ["plancurate"]  # given: working them out would load the model in a process of its own


def log_dataset(client: MlflowClient, run_id: str, child: ChildRun) -> None:
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


def log_model(client: MlflowClient, experiment_id: str, run_id: str, child: ChildRun) -> str:
    """Store the policy with its world as an MLflow model: files and the name of the module that loads them."""
    import mlflow.pyfunc
    import numpy as np
    from mlflow.entities import LoggedModelOutput, LoggedModelStatus
    from mlflow.models import Model, ModelSignature
    from mlflow.types import Schema, TensorSpec

    from plancurate.tasks.motion.served import save_served

    # Targets or observations in; what comes out for a target is no tensor.
    signature = ModelSignature(inputs=Schema([TensorSpec(np.dtype(np.float64), (-1, -1))]))
    tags = {"selection": child.selection, "policy": child.policy, "seed": str(child.seed)}
    model = client.create_logged_model(experiment_id, name=child.model_name, source_run_id=run_id, tags=tags)
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


def champion(uri: str, name: str) -> str | None:
    """Return the evaluation id of a registered model's champion; None where none is registered."""
    client = open_client(uri)
    for model in client.search_registered_models(f"name = '{name}'"):
        if version := model.aliases.get(CHAMPION):
            return str(client.get_model_version(name, version).tags[EVALUATION])
    return None


def set_champion(run: StudyRun, name: str, evaluation_id: str, reason: str) -> None:
    """Register a network that was logged as the model's next version and point the alias to it; copies nothing."""
    client = open_client(run.uri)
    logged = f"tags.`{EVALUATION}` = '{evaluation_id}' AND tags.`{STUDY}` = '{run.study}'"
    (network,) = client.search_runs([run.experiment_id], logged, max_results=1)
    model = client.get_logged_model(network.outputs.model_outputs[0].model_id)
    if not client.search_registered_models(f"name = '{name}'"):
        client.create_registered_model(name, description="The policy to use, by its alias `champion`.")
    # A database would look a model's id up in whichever store the environment names.
    source = model.artifact_location if not is_server(run.uri) else model.model_uri
    version = client.create_model_version(
        name,
        source,
        network.info.run_id,
        tags={STUDY: run.study, EVALUATION: evaluation_id},
        description=reason,
        model_id=model.model_id,
        await_creation_for=0,
    )
    client.set_registered_model_alias(name, CHAMPION, version.version)
