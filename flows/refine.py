"""Correct every policy on its training targets, round by round, and train it again on what it is shown."""

from __future__ import annotations

from prefect import flow, task
from prefect.cache_policies import NO_CACHE

from plancurate.flows.begin import begin
from plancurate.flows.forms import CorrectedConfig
from plancurate.flows.progress import stage
from plancurate.flows.task_runs import run_all, shared_runner
from plancurate.flows.train import train_missing
from plancurate.tasks.study.context import StudyContext, StudyRef, reference
from plancurate.tasks.study.corrections import make_corrections, missing_corrections
from plancurate.tasks.study.networks import Network, wanted_networks
from plancurate.tasks.study.selections import study_selections


@flow(name="refine", flow_run_name="refine {config.name}")
def refine(config: CorrectedConfig, home: str = "") -> None:
    """Do the study's rounds of corrections as far as they are missing: one task run for each network and round.

    Args:
        config: The study: a preset, and what is different from it.
        home: Folder of the lake, MLflow, Prefect and the reports; empty: the one that is served.
    """
    study = begin(config, home, "selections", "corrections")
    networks = wanted_networks(study, study_selections(study))
    for round in range(1, config.corrections.rounds + 1):
        corrected = [network for network in networks if network.round == round]
        correct_missing(study, corrected, round)
        train_missing(study, corrected)


def correct_missing(study: StudyContext, networks: list[Network], round: int) -> None:
    """Make the corrections of a round that the lake lacks."""
    missing = missing_corrections(study, networks)
    with stage(f"correct-{round}", len(missing), "networks") as bar:
        calls = ((reference(study), network, network.network_id) for network in missing)
        config = study.config
        run_all(correct, calls, config.workers, lambda _: bar.advance(), runner=shared_runner(config))


@task(
    name="correct",
    task_run_name="correct {title}",
    tags=["train"],
    timeout_seconds=6 * 3600,
    cache_policy=NO_CACHE,
    persist_result=False,
)
def correct(study: StudyRef, network: Network, title: str) -> int:
    """Write the corrections of one network; gives how many."""
    return make_corrections(study.open(), network)
