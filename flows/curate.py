"""Select from the pools with every selector, budget and selection seed of a study."""

from __future__ import annotations

from prefect import flow, task
from prefect.cache_policies import NO_CACHE

from plancurate.flows.begin import begin
from plancurate.flows.forms import SelectionsConfig
from plancurate.flows.label import label_all
from plancurate.flows.progress import stage
from plancurate.flows.run_page import show_table, tell
from plancurate.flows.task_runs import run_all
from plancurate.tasks.study import text
from plancurate.tasks.study.context import StudyRef, reference
from plancurate.tasks.study.records import record_study
from plancurate.tasks.study.selection_results import ranking_rows
from plancurate.tasks.study.selections import WantedSelection, applies, make_selection, study_selections


@flow(name="curate", flow_run_name="curate {config.name}")
def curate(config: SelectionsConfig, home: str = "") -> None:
    """Select from the study's candidates: one task run for each selection, recorded in the lake.

    Args:
        config: The study: a preset, and what is different from it.
        home: Folder of the lake, MLflow, Prefect and the reports; empty: the one that is served.
    """
    study = begin(config, home, "ways", "selections", "rankings", "studies")
    label_all(study)  # candidates that other studies planned
    wanted = study_selections(study)
    record_study(study)
    for pool in study.pools:
        if left_out := [choice.label for choice in config.selectors if not applies(choice, pool)]:
            tell(
                f"  scene {pool.title}: without {', '.join(left_out)}: who rolls out, trains or times needs one scene"
            )
    with stage("curate", len(wanted), "selections") as bar:
        calls = ((reference(study), selection, selection.title) for selection in wanted)
        # Side by side they would lengthen each other's selection time.
        run_all(select, calls, in_flight=1, ended=lambda _: bar.advance())
    for row in ranking_rows(study.lake, study.study):
        if row.unsteady:
            tell(f"  {text.unsteady(row)}", style="yellow")
    coverage = study.lake.query("results/coverage", study=study.study).to_pylist()
    show_table("coverage", coverage, "What each selection keeps of the pool's targets.")


@task(
    name="curate",
    task_run_name="curate {title}",
    tags=["curate"],
    timeout_seconds=3600,
    cache_policy=NO_CACHE,
    persist_result=False,
)
def select(study: StudyRef, selection: WantedSelection, title: str) -> str:
    """Make one selection, or find it in the lake; gives its id."""
    return make_selection(study.open(), selection).selection_id
