"""Merge the many small files of a pool, one task run for each planner, with readers at work."""

from __future__ import annotations

from prefect import flow, task
from prefect.cache_policies import NO_CACHE

from plancurate.flows.progress import Bar, stage
from plancurate.flows.task_runs import run_all
from plancurate.tasks.lake import compact as steps
from plancurate.tasks.lake.home import Home
from plancurate.tasks.study.config import StudyConfig
from plancurate.tasks.study.context import Workplace


@flow(name="compact", flow_run_name="compact {config.name}")
def compact(config: StudyConfig, home: str | None = None) -> None:
    """Merge the trajectories of each planner into one file; small files go when nobody can be reading them."""
    place = Workplace(config, Home.resolve(home))
    with stage("compact", len(config.planners), "planners") as bar:
        run_all(merge, ((place, planner, bar) for planner in config.planners), in_flight=1)


@task(
    name="compact",
    task_run_name="compact {planner}",
    timeout_seconds=3600,
    cache_policy=NO_CACHE,
    persist_result=False,
)
def merge(place: Workplace, planner: str, bar: Bar) -> None:
    """Merge one planner's parts."""
    steps.compact(place.lake, "trajectories", {**place.partition, "planner": planner}, place.metadata)
    bar.advance()
