"""Label the ways of a study's candidates: a step of other flows."""

from __future__ import annotations

from prefect import task
from prefect.cache_policies import NO_CACHE

from plancurate.flows.task_runs import is_transient, run_all
from plancurate.tasks.study.context import StudyContext, StudyRef, reference
from plancurate.tasks.study.ways import Block, label_ways, unlabelled


def label_all(study: StudyContext) -> None:
    """Label the targets that are planned and not labelled yet, in threads: the work is in C++."""
    calls = [(reference(study), block, block.label) for block in unlabelled(study)]
    if calls:
        run_all(label, calls, in_flight=study.config.workers)


@task(
    task_run_name="label targets {label}",
    retries=2,
    retry_delay_seconds=1,
    retry_condition_fn=is_transient,
    timeout_seconds=3600,
    cache_policy=NO_CACHE,
    persist_result=False,
)
def label(study: StudyRef, block: Block, label: str) -> int:
    """Label one block and write it to the lake; gives how many candidates it holds."""
    return label_ways(study.open(), block)
