"""The whole way: candidates, selections, policies, corrections, tests, results."""

from __future__ import annotations

from prefect import flow, task
from prefect.cache_policies import NO_CACHE

from plancurate.errors import IncompleteError
from plancurate.flows.curate import curate
from plancurate.flows.evaluate import evaluate
from plancurate.flows.generate import generate
from plancurate.flows.publish import publish
from plancurate.flows.refine import refine
from plancurate.flows.task_runs import shared_runner
from plancurate.flows.train import train
from plancurate.tasks.lake.home import Home
from plancurate.tasks.study.checks import audit_study
from plancurate.tasks.study.config import StudyConfig
from plancurate.tasks.study.context import open_study
from plancurate.tasks.study.exclusive import exclusive
from plancurate.tasks.study.tracking import ensure_store


@flow(name="study", flow_run_name="study {config.name}")
def study(config: StudyConfig, home: str | None = None) -> None:
    """Plan, curate, train, refine, evaluate and publish; every stage does only what the home folder lacks."""
    opened = open_study(config, Home.resolve(home))
    ensure_store(opened.home.mlflow_db)  # a tracking server that is away is said now, not after the work
    with exclusive(opened.home, opened.study), shared_runner(config):
        generate(config, home)
        curate(config, home)
        train(config, home)
        refine(config, home)
        evaluate(config, home)
        publish(config, home)
        audit(config, home)


@task(task_run_name="audit", cache_policy=NO_CACHE, persist_result=False)
def audit(config: StudyConfig, home: str | None) -> None:
    """Check what the study wrote; raises IncompleteError that names every broken rule."""
    if broken := audit_study(open_study(config, Home.resolve(home))):
        raise IncompleteError("; ".join(broken))
