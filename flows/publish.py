"""Take a study's results from the lake to MLflow, to Prefect's pages and to the reports folder."""

from __future__ import annotations

import base64

from prefect import flow, task
from prefect.artifacts import create_markdown_artifact
from prefect.cache_policies import NO_CACHE

from plancurate.flows.cli.tables import matrix_markdown
from plancurate.flows.curate import study_pool
from plancurate.flows.evaluate import evaluation_id, study_folder
from plancurate.flows.progress import Bar, stage
from plancurate.flows.train import Network, networks
from plancurate.tasks.lake.catalog import write_catalog
from plancurate.tasks.lake.home import Home
from plancurate.tasks.learning.policies import load_policy
from plancurate.tasks.learning.policies.serving import ServedPolicy
from plancurate.tasks.report import Report, build_report, markdown, write_report
from plancurate.tasks.report.page import style_sheet
from plancurate.tasks.study.config import StudyConfig
from plancurate.tasks.study.context import Workplace
from plancurate.tasks.study.results import ResultRow, result_rows, summary_rows
from plancurate.tasks.study.tracking import (
    ChildRun,
    StudyRun,
    ensure_store,
    finish_study,
    log_child,
    log_report,
    start_study,
)


@flow(name="publish", flow_run_name="publish {config.name}")
def publish(config: StudyConfig, home: str | None = None) -> None:
    """Log every network's results and model to MLflow and write the study's report."""
    place = Workplace(config, Home.resolve(home))
    trained = networks(place, study_pool(place))
    rows = {
        (row.selector, row.budget, row.policy, row.seed): row
        for row in result_rows(place.lake, study_folder(config))
    }
    run = open_study(place)
    with stage("track", len(trained), "runs") as bar:
        track(place, run, trained, rows, bar)
    table = write_tables(place)
    log_report(run, place.home.reports / config.name)
    write_catalog(place.lake.root)
    best = summary_rows(place.lake, study_folder(config))[0]
    finish_study(run, table, {"best_success_rate": best.success_rate, "networks": float(len(trained))})


def open_study(place: Workplace) -> StudyRun:
    """Open the study's parent run in MLflow."""
    config = place.config
    flat = {name: value for name, value in config.model_dump(mode="json").items() if name != "candidates"}
    tags = {"robot": place.robot.name, "scene": place.scene.name, "pool": place.pool, "study": config.name}
    uri = ensure_store(place.home.mlflow_db)
    return start_study(uri, place.home.artifacts, config.name, config.key, flat, tags)


@task(task_run_name="track results", cache_policy=NO_CACHE, persist_result=False)
def track(
    place: Workplace,
    run: StudyRun,
    trained: list[Network],
    rows: dict[tuple[str, int | None, str, int], ResultRow],
    bar: Bar,
) -> None:
    """Record one child run for each network, unless an earlier run of the study did."""
    for network in trained:
        selection = network.selection
        row = rows[selection.selector, selection.budget, network.policy, network.seed]
        log_child(run, child_run(place, network, row))
        bar.advance()


def child_run(place: Workplace, network: Network, row: ResultRow) -> ChildRun:
    """Gather what MLflow shows of one network."""
    selection, policy = network.selection, load_policy(network.folder)
    metrics = {
        "success_rate": row.success_rate,
        "success_rate_ci_low": row.ci_low,
        "success_rate_ci_high": row.ci_high,
        "settled_rate": row.settled_rate,
        "settled_rate_ci_low": row.settled_ci_low,
        "settled_rate_ci_high": row.settled_ci_high,
        "final_distance": row.final_distance,
        "path_length": row.path_length,
        "joint_movement": row.joint_movement,
        "selection_time_s": row.selection_time_s,
        **{f"selection_{name}_s": seconds for name, seconds in selection.seconds.items()},
        "train_time_s": policy.train_s,
        **{f"policy_{name}": value for name, value in policy.diagnostics.items()},
        "n": row.n,
        "n_kept": row.n_kept,
    }
    params = {
        "steps": place.config.training.steps,
        "learning_rate": place.config.training.learning_rate,
        **{f"policy.{name}": value for name, value in policy.policy.model_dump().items()},
        **{f"selector.{name}": value for name, value in selection.params.items()},
    }
    return ChildRun(
        evaluation_id=evaluation_id(place, network),
        selector=selection.selector,
        budget=selection.budget,
        policy=network.policy,
        seed=network.seed,
        params=params,
        metrics=metrics,
        loss_curve=policy.loss_curve,
        pool_hash=selection.pool_hash,
        selection_id=selection.selection_id,
        n_kept=row.n_kept,
        model_folder=network.folder,
        model_inputs=ServedPolicy(policy).inputs,
        dof=place.robot.dof,
        tags={"robot": place.robot.name, "scene": place.scene.name},
    )


@task(task_run_name="write tables", cache_policy=NO_CACHE, persist_result=False)
def write_tables(place: Workplace) -> str:
    """Write the report to the reports folder and its tables to Prefect; return the matrix as Markdown."""
    study = study_folder(place.config)
    report = build_report(place.lake, study)
    write_report(report, place.home.reports / place.config.name)
    create_markdown_artifact(
        markdown(report, figures=False), key="results", description=f"Report of study {place.config.name}"
    )
    create_markdown_artifact(
        pictures(report), key="figures", description=f"Figures of study {place.config.name}"
    )
    rows, summaries = result_rows(place.lake, study), summary_rows(place.lake, study)
    return f"# {place.config.name}: success in percent\n\n{matrix_markdown(rows, summaries)}"


def pictures(report: Report) -> str:
    """Return the report's figures as Markdown that holds its images itself: Prefect serves no files."""
    style, lines = style_sheet(), []
    for figure in report.figures:
        lines.append(f"## {figure.title}")
        for caption, drawing in figure.pictures:
            image = base64.b64encode(drawing.svg(style).encode()).decode()
            lines.append(f"![{caption or figure.title}](data:image/svg+xml;base64,{image})")
    return "\n\n".join(lines)
