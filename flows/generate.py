"""Plan, time, play back and store every candidate that the lake does not hold yet."""

from __future__ import annotations

from contextlib import nullcontext

from prefect import flow, task
from prefect.cache_policies import NO_CACHE

from plancurate.errors import IncompleteError
from plancurate.flows.begin import begin
from plancurate.flows.events import tell_pool_ready
from plancurate.flows.forms import PoolConfig
from plancurate.flows.label import label_all
from plancurate.flows.progress import stage
from plancurate.flows.run_page import show_table, tell
from plancurate.flows.task_runs import is_transient, run_all, shared_runner
from plancurate.tasks.candidates.postprocess_pool import shared_pool
from plancurate.tasks.study import text
from plancurate.tasks.study.candidates import (
    Part,
    Planned,
    make_part,
    missing_parts,
    study_targets,
)
from plancurate.tasks.study.context import StudyContext, StudyRef, reference
from plancurate.tasks.study.pools import study_pools
from plancurate.tasks.study.records import record_study

TIMEOUT_S = 3600  # of one part


@flow(name="generate", flow_run_name="generate {config.name}")
def generate(config: PoolConfig, home: str = "") -> None:
    """Fill the lake with candidates: one task run for each planner and target, its runs inside.

    Doing it again plans only what is missing; a larger study reuses what a smaller one left.

    Args:
        config: The study: a preset, and what is different from it.
        home: Folder of the lake, MLflow, Prefect and the reports; empty: the one that is served.
    """
    study = begin(config, home, "targets", "trajectories", "ways", "studies")
    for pool in study.pools:
        draw_targets(reference(study), pool.pool)
    if parts := missing_candidates(study):
        plan_all(study, parts)
    if parts := missing_candidates(study):
        raise IncompleteError(f"{len(parts)} parts are not in the lake, the first {parts[0]}")
    label_all(study)
    record_study(study)
    say_what_pools_are_worth(study)
    planners = study.lake.query("results/planners", study=study.study).to_pylist()
    show_table("planners", planners, "What each planner solved, and how long it took.")


@task(task_run_name="sample targets", cache_policy=NO_CACHE, persist_result=False)
def draw_targets(study: StudyRef, pool: str) -> None:
    """Draw and store the targets of a pool that are not there yet."""
    opened = study.open()
    study_targets(opened, opened.pool(pool))


def missing_candidates(study: StudyContext) -> list[Part]:
    """Return what the lake lacks of the study's candidates, pool by pool."""
    return [part for pool in study.pools for part in missing_parts(study, pool, study_targets(study, pool))]


def plan_all(study: StudyContext, parts: list[Part]) -> None:
    """Plan these parts; beside planning threads, other processes time and play back."""
    config, ref = study.config, reference(study)
    threads = config.runner == "threads"
    runs = sum(study.pool(part.pool).settings.plan.runs * len(part.targets) for part in parts)
    with shared_pool(config.workers) if threads else nullcontext(), stage("plan", runs, "runs") as bar:
        calls = ((ref, part, part.planner, part.label) for part in parts)
        in_flight = (
            2 * config.workers if threads else config.workers
        )  # one plans while another is played back
        run_all(
            # In a thread a timeout interrupts nothing, but costs two threads and a warning in the log of each run.
            plan if threads else plan.with_options(timeout_seconds=TIMEOUT_S),
            calls,
            in_flight,
            lambda planned: bar.advance(planned.runs, planned.failed),
            runner=shared_runner(config),
        )


def say_what_pools_are_worth(study: StudyContext) -> None:
    """Say how many candidates of each pool differ and in how many ways: curation can only choose among those."""
    for pool in study_pools(study.lake, study.study):
        tell(f"  {text.group(pool)}: {text.pool(pool)}", style="yellow" if pool.degenerate else "dim")
        tell_pool_ready(study, pool)


# No tags: for a tagged task run Prefect asks its server for a concurrency slot, a tenth of the run's own work.
@task(
    task_run_name="plan {planner} target {label}",
    retries=2,
    retry_delay_seconds=1,
    retry_condition_fn=is_transient,
    cache_policy=NO_CACHE,
    persist_result=False,
)
def plan(study: StudyRef, part: Part, planner: str, label: str) -> Planned:
    """Plan, time and verify one part and write it to the lake."""
    return make_part(study.open(), part)
