"""Merge the many small files of a study's pools, one task run for each planner, with readers at work."""

from __future__ import annotations

from prefect import flow, task
from prefect.cache_policies import NO_CACHE

from plancurate.flows.forms import PoolConfig
from plancurate.flows.progress import stage
from plancurate.flows.task_runs import run_all
from plancurate.tasks.lake import compact as steps
from plancurate.tasks.lake.home import Home
from plancurate.tasks.study.context import StudyRef, open_study, reference


@flow(name="compact", flow_run_name="compact {config.name}")
def compact(config: PoolConfig, home: str = "") -> None:
    """Merge the trajectories of each planner into one file; small files go when nobody can be reading them.

    Args:
        config: The study: a preset, and what is different from it.
        home: Folder of the lake, MLflow, Prefect and the reports; empty: the one that is served.
    """
    study = open_study(config, Home.resolve(home))
    calls = [(reference(study), pool.pool, planner) for pool in study.pools for planner in study.sources]
    with stage("compact", len(calls), "planners") as bar:
        run_all(merge, calls, in_flight=1, ended=lambda _: bar.advance())


@task(
    name="compact",
    task_run_name="compact {planner}",
    timeout_seconds=3600,
    cache_policy=NO_CACHE,
    persist_result=False,
)
def merge(study: StudyRef, pool: str, planner: str) -> None:
    """Merge one planner's parts of a pool."""
    opened = study.open()
    context = opened.pool(pool)
    steps.compact(opened.lake, "trajectories", {**context.partition, "planner": planner}, context.metadata)
