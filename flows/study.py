"""The whole way: candidates, selections, policies, corrections, tests, results."""

from __future__ import annotations

from typing import Annotated

from prefect import flow, task
from prefect.cache_policies import NO_CACHE
from prefect.client.schemas.objects import State
from prefect.states import Completed
from pydantic import Field
from rich.markup import escape

from plancurate.errors import IncompleteError
from plancurate.flows.curate import curate
from plancurate.flows.evaluate import evaluate
from plancurate.flows.forms import WholeConfig
from plancurate.flows.generate import generate
from plancurate.flows.publish import publish
from plancurate.flows.refine import refine
from plancurate.flows.run_page import one_page, tell
from plancurate.flows.task_runs import shared_runner
from plancurate.flows.train import train
from plancurate.tasks.lake.home import Home
from plancurate.tasks.study.checks import audit_study
from plancurate.tasks.study.config import MOST_TARGETS, GrowBy, StudyConfig
from plancurate.tasks.study.context import open_study
from plancurate.tasks.study.exclusive import exclusive
from plancurate.tasks.study.growth import grown
from plancurate.tasks.study.mlflow_store import ensure_store
from plancurate.tasks.study.run_line import held_evaluations, run_line

Grow = Annotated[int, Field(ge=0, le=MOST_TARGETS)]


@flow(name="study", flow_run_name="study {config.name}")
def study(config: WholeConfig, grow: Grow = 0, grow_by: GrowBy = "targets", home: str = "") -> State[None]:
    """Plan, curate, train, refine, evaluate and publish; every stage does only what the home folder lacks.

    What the run did is the message of its final state, and its last line.

    Args:
        config: The study: a preset, and what is different from it.
        grow: Training targets, or runs, to add to what the study was last run to its end with; 0: as configured.
            Tests at unseen targets stay the same, so that each run is compared with the one before it.
        grow_by: What is added: training targets (where scenes vary, scenes too), or runs of each planner to a target.
        home: Folder of the lake, MLflow, Prefect and the reports; empty: the one that is served.
    """
    config = grown(config, Home.resolve(home), grow, grow_by)
    opened = open_study(config, Home.resolve(home))
    ensure_store(opened.home.mlflow_db)  # a tracking server that is away is said now, not after the work
    with exclusive(opened.home, opened.study), shared_runner(config), one_page():
        tested_before = held_evaluations(opened)
        generate(config, home)
        curate(config, home)
        train(config, home)
        refine(config, home)
        evaluate(config, home)
        champions = publish(config, home)
        audit(config, home)
        line = run_line(opened, tested_before, champions)
    tell(escape(line))
    return Completed(message=line)


@task(task_run_name="audit", cache_policy=NO_CACHE, persist_result=False)
def audit(config: StudyConfig, home: str) -> None:
    """Check what the study wrote; raises IncompleteError that names every broken rule."""
    if broken := audit_study(open_study(config, Home.resolve(home))):
        raise IncompleteError("; ".join(broken))
