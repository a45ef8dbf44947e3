"""Roll out every trained policy of a study and record each trial."""

from __future__ import annotations

from prefect import flow, task
from prefect.cache_policies import NO_CACHE

from plancurate.flows.begin import begin
from plancurate.flows.forms import WholeConfig
from plancurate.flows.progress import stage
from plancurate.flows.task_runs import run_all, run_groups, shared_runner
from plancurate.tasks.study.context import StudyRef, reference
from plancurate.tasks.study.evaluations import count_rollouts, evaluate_networks, missing_evaluations
from plancurate.tasks.study.motion_verdicts import missing_verdicts, verify_rollouts
from plancurate.tasks.study.networks import Network
from plancurate.tasks.study.records import record_study
from plancurate.tasks.study.references import make_references, missing_references


@flow(name="evaluate", flow_run_name="evaluate {config.name}")
def evaluate(config: WholeConfig, home: str = "") -> None:
    """Test what is not tested yet: one task run for some networks of a policy on all tests of a pool at once.

    Args:
        config: The study: a preset, and what is different from it.
        home: Folder of the lake, MLflow, Prefect and the reports; empty: the one that is served.
    """
    study = begin(config, home, "evaluations", "reference_trials", "motion_verdicts", "studies")
    missing = missing_evaluations(study)
    record_study(study)
    pools = [(reference(study), pool.pool, pool.title) for pool in missing_references(study)]
    run_all(reference_trials, pools, config.workers, runner=shared_runner(config))
    with stage("evaluate", count_rollouts(study, missing), "rollouts") as bar:
        run_groups(evaluate_group, study, missing, bar.advance)
    if unverified := missing_verdicts(study):
        with stage("verify", len(unverified), "networks") as bar:
            run_groups(verify_group, study, unverified, bar.advance)


@task(
    name="references",
    task_run_name="references {title}",
    tags=["evaluate"],
    cache_policy=NO_CACHE,
    persist_result=False,
)
def reference_trials(study: StudyRef, pool: str, title: str) -> int:
    """Record what a planner, a replayed trajectory and a straight line reach of a pool's tests; gives how many."""
    opened = study.open()
    return make_references(opened, opened.pool(pool))


@task(
    name="evaluate",
    task_run_name="evaluate {title}",
    tags=["evaluate"],
    timeout_seconds=6 * 3600,
    cache_policy=NO_CACHE,
    persist_result=False,
)
def evaluate_group(study: StudyRef, networks: tuple[Network, ...], title: str) -> int:
    """Roll networks of one policy out and write one part of trials for each; gives how many rollouts."""
    return evaluate_networks(study.open(), networks)


@task(
    name="verify rollouts",
    task_run_name="verify {title}",
    tags=["evaluate"],
    timeout_seconds=6 * 3600,
    cache_policy=NO_CACHE,
    persist_result=False,
)
def verify_group(study: StudyRef, networks: tuple[Network, ...], title: str) -> int:
    """Time and verify rollouts of networks of one policy and write one part of verdicts for each; gives how many."""
    return verify_rollouts(study.open(), networks)
