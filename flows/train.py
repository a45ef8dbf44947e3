"""Train every policy on every selection of a study."""

from __future__ import annotations

from prefect import flow, task
from prefect.cache_policies import NO_CACHE

from plancurate.flows.begin import begin, say_made_again
from plancurate.flows.forms import NetworksConfig
from plancurate.flows.progress import stage
from plancurate.flows.task_runs import run_groups
from plancurate.tasks.study.context import StudyContext, StudyRef
from plancurate.tasks.study.networks import (
    Network,
    is_trained,
    set_damaged_aside,
    train_networks,
    wanted_networks,
)
from plancurate.tasks.study.selections import study_selections


@flow(name="train", flow_run_name="train {config.name}")
def train(config: NetworksConfig, home: str = "") -> None:
    """Train what the home folder does not hold yet: one task run for some networks of a policy at once.

    Args:
        config: The study: a preset, and what is different from it.
        home: Folder of the lake, MLflow, Prefect and the reports; empty: the one that is served.
    """
    study = begin(config, home, "selections")
    train_missing(study, [n for n in wanted_networks(study, study_selections(study)) if n.round == 0])


def train_missing(study: StudyContext, networks: list[Network]) -> None:
    """Train those of these networks that the home folder does not hold whole."""
    say_made_again(set_damaged_aside(study, networks))
    missing = [network for network in networks if not is_trained(study, network)]
    with stage("train", len(missing), "networks") as bar:
        run_groups(train_group, study, missing, bar.advance)


@task(
    name="train",
    task_run_name="train {title}",
    tags=["train"],
    timeout_seconds=6 * 3600,
    cache_policy=NO_CACHE,
    persist_result=False,
)
def train_group(study: StudyRef, networks: tuple[Network, ...], title: str) -> int:
    """Train networks of one policy together; gives how many."""
    train_networks(study.open(), networks)
    return len(networks)
