"""Predict motions with a study's policy, or the planner where it does not get there, and verify what was written."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
from prefect import flow, task
from prefect.cache_policies import NO_CACHE
from pydantic import Field

from plancurate.errors import IncompleteError
from plancurate.flows.run_page import show_table
from plancurate.flows.verify import verify
from plancurate.offers import offers
from plancurate.tasks.candidates.payload import Payload
from plancurate.tasks.lake.home import Home
from plancurate.tasks.motion.predict import predict_motions
from plancurate.tasks.motion.settings import MotionSettings
from plancurate.tasks.motion.target_files import write_predictions
from plancurate.tasks.study.config import registered_policies
from plancurate.tasks.study.predictor import Choice, study_policy

Target = tuple[float, float, float]


@flow(name="predict", flow_run_name="predict with {study}")
def predict(
    study: str,
    targets: list[Target],
    out: str = "motions/motion.csv",
    scene: str = "",
    selector: str = "",
    policy: Annotated[str, Field(json_schema_extra=offers(registered_policies))] | None = None,
    payload: Payload | None = None,
    home: str = "",
) -> list[dict[str, Any]]:
    """Make a verified motion to each target, m, and write them to `out`, below the home folder, numbered.

    Gives who made each, how long each step took, its file and its verdict.

    Args:
        study: Name of a study that was run to its end.
        targets: Positions for the tool in the robot's frame, m.
        out: File for the motions, below the home folder; of several each is numbered before the ending.
        scene: Scene of the study, where it has several; empty: the only one.
        selector: Selector that the policy learnt from, with or without its budget; empty: the study's best.
        policy: Policy; empty: the selector's best.
        payload: What the tool carries; empty: nothing.
        home: Folder of the lake, MLflow, Prefect and the reports; empty: the one that is served.
    """
    root = Home.resolve(home).root
    choice = Choice(study, scene=scene or None, selector=selector or None, policy=policy)
    records = make_motions(choice, targets, str(root / out), payload, home)
    for record in records:
        if record["file"]:
            verdict = verify(record["file"], record["robot"], record["scene"], MotionSettings(), payload)
            if not verdict["passed"]:
                raise IncompleteError(f"{record['file']}: {verdict['first']['message']}")
    show_table("motions", [row(record) for record in records], "Who made each motion, and how long it took.")
    return records


@task(task_run_name="make motions", cache_policy=NO_CACHE, persist_result=False)
def make_motions(
    choice: Choice, targets: list[Target], out: str, payload: Payload | None, home: str
) -> list[dict[str, Any]]:
    """Make and write the motions; gives a record of each."""
    chosen = study_policy(Home.resolve(home), choice)
    positions = np.array(targets, dtype=np.float64)
    found = predict_motions(chosen.trained, chosen.robot, chosen.scene, positions, chosen.settings, payload)
    Path(out).parent.mkdir(parents=True, exist_ok=True)
    files = write_predictions(Path(out), found)
    robot, scene = chosen.sources
    return [
        {**one.as_record(), "file": file and str(file), "robot": robot, "scene": scene}
        for one, file in zip(found, files, strict=True)
    ]


def row(record: dict[str, Any]) -> dict[str, Any]:
    """What the artifact shows of a motion."""
    shown = ("target", "made_by", "duration_s", "distance_m", "file")
    return {name: record[name] for name in shown} | {f"{k}_s": v for k, v in record["seconds"].items()}
