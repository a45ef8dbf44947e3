"""Take a study's results from the lake to MLflow, to Prefect's pages and to the reports folder."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from prefect import flow, task
from prefect.cache_policies import NO_CACHE

from plancurate.flows.cli.tables import matrix_markdown
from plancurate.flows.events import tell_study_published
from plancurate.flows.forms import WholeConfig
from plancurate.flows.progress import stage
from plancurate.flows.run_page import show_text, write_log
from plancurate.flows.task_runs import run_all
from plancurate.tasks.lake.catalog import write_catalog
from plancurate.tasks.lake.home import Home
from plancurate.tasks.report import Report, build_report, markdown, study_pictures, write_report
from plancurate.tasks.report.embedded import figures_markdown
from plancurate.tasks.study.champions import crown_networks
from plancurate.tasks.study.context import StudyRef, open_study, reference
from plancurate.tasks.study.mlflow_records import StudyRun
from plancurate.tasks.study.mlflow_runs import (
    Metrics,
    best_metrics,
    log_networks,
    open_parent_run,
    selection_metrics,
)
from plancurate.tasks.study.mlflow_store import check_reachable, said_when_lost
from plancurate.tasks.study.networks import Network, groups, titles, wanted_networks
from plancurate.tasks.study.results import study_results
from plancurate.tasks.study.selections import study_selections
from plancurate.tasks.study.tracking import finish_study, log_report


@flow(name="publish", flow_run_name="publish {config.name}")
def publish(config: WholeConfig, home: str = "") -> list[str]:
    """Log results and model of every network, after its last round, to MLflow and write the study's report.

    Gives what became of the champions, a line each.

    Args:
        config: The study: a preset, and what is different from it.
        home: Folder of the lake, MLflow, Prefect and the reports; empty: the one that is served.
    """
    study = open_study(config, Home.resolve(home))
    rounds = config.corrections.rounds
    networks = [n for n in wanted_networks(study, study_selections(study)) if n.round == rounds]
    with said_when_lost():
        run, ref = open_parent_run(study, networks), reference(study)
        with stage("track", len(networks), "runs") as bar:
            run_all(track, track_calls(ref, run, networks), in_flight=1, ended=bar.advance)
        champions = crown(ref, run)
        report, table, best, selections = write_tables(ref)
        show_report(report, study.study)
        log_report(run, study.home.reports / study.study)
        write_catalog(study.lake.root)
        finish_study(run, table, {**best, "networks": float(len(networks))}, selections)
    tell_study_published(study.study, report.verdict)
    return champions


def track_calls(study: StudyRef, run: StudyRun, networks: Sequence[Network]) -> Iterator[tuple[Any, ...]]:
    """Give the arguments of every call of `track`; PlancurateError once MLflow's server is gone.

    Each call would wait for it in vain, a few seconds.
    """
    together = groups(study.open(), networks)
    for call in zip(together, titles(together), strict=True):
        check_reachable(run.uri)
        yield (study, run, *call)


@task(task_run_name="track {title}", cache_policy=NO_CACHE, persist_result=False)
def track(study: StudyRef, run: StudyRun, networks: tuple[Network, ...], title: str) -> int:
    """Record a child run for each network, unless an earlier run of the study did; gives how many."""
    log_networks(study.open(), run, networks)
    return len(networks)


@task(task_run_name="champions", cache_policy=NO_CACHE, persist_result=False)
def crown(study: StudyRef, run: StudyRun) -> list[str]:
    """Move the alias `champion` of each policy where a network is better; gives what became of it."""
    return crown_networks(study.open(), run)


@task(task_run_name="write tables", cache_policy=NO_CACHE, persist_result=False)
def write_tables(study: StudyRef) -> tuple[Report, str, Metrics, dict[str, Metrics]]:
    """Write the report to the reports folder.

    Gives it, verdict and matrix as Markdown, metrics of the best selection, and of each by the title of its run.
    """
    opened = study.open()
    results = study_results(opened.lake, opened.study)
    report = build_report(results, study_pictures(opened.home, results))
    write_report(report, opened.home.reports / opened.study)
    verdict = "\n".join(f"- {sentence}" for sentence in report.verdict)
    table = f"{verdict}\n\n## Success in percent\n\n{matrix_markdown(results.headline)}"
    summaries = results.headline.summaries
    return report, table, best_metrics(summaries[0]), selection_metrics(opened, summaries)


def show_report(report: Report, study: str) -> None:
    """Put a study's report on the page: what a task run puts there stands below everything else."""
    show_text("results", markdown(report, figures=False), f"The verdict and the tables of {study}.")
    show_text("figures", figures_markdown(report), f"The figures of {study}.")
    for sentence in report.verdict:
        write_log(sentence)
