"""Select from the pool with every selector and budget of a study."""

from __future__ import annotations

from prefect import flow, task
from prefect.cache_policies import NO_CACHE

from plancurate.flows.artifacts import table_artifact
from plancurate.flows.progress import Bar, stage
from plancurate.flows.task_runs import run_all
from plancurate.tasks.curation import curate as steps
from plancurate.tasks.curation.learning_settings import LearningSettings
from plancurate.tasks.curation.pool import Pool, load_pool
from plancurate.tasks.curation.selectors.base import find_selector
from plancurate.tasks.curation.selectors.selection import Selection, label
from plancurate.tasks.lake.home import Home
from plancurate.tasks.study.config import StudyConfig
from plancurate.tasks.study.context import Workplace


@flow(name="curate", flow_run_name="curate {config.name}")
def curate(config: StudyConfig, home: str | None = None) -> None:
    """Select from the study's candidates: one task run for each selector and budget, recorded in the lake."""
    place = Workplace(config, Home.resolve(home))
    pool = study_pool(place)
    wanted = [(name, budget) for name in config.selectors for budget in budgets(name, config)]
    with stage("curate", len(wanted), "selections") as bar:
        calls = ((place, pool, name, budget, label(name, budget), bar) for name, budget in wanted)
        run_all(
            select_part, calls, in_flight=1
        )  # side by side they would lengthen each other's selection time
    coverage = place.lake.query("results/coverage", **place.partition)
    table_artifact("coverage", coverage.to_pylist(), "What each selection keeps of the pool's targets.")


@task(
    name="curate",
    task_run_name="curate {label}",
    tags=["curate"],
    timeout_seconds=3600,
    cache_policy=NO_CACHE,
    persist_result=False,
)
def select_part(
    place: Workplace, pool: Pool, selector: str, budget: int | None, label: str, bar: Bar
) -> None:
    """Make one selection, or find it in the lake."""
    make_selection(place, pool, selector, budget)
    bar.advance()


def make_selection(place: Workplace, pool: Pool, selector: str, budget: int | None) -> Selection:
    """Return one of the study's selections, made now or found in the lake."""
    config = place.config
    return steps.curate(
        place.lake,
        pool,
        selector,
        budget,
        config.selector_seed,
        robot=place.robot,
        scene=place.scene,
        learning=LearningSettings(config.training, config.evaluation, config.candidates.timing),
        metadata=place.metadata,
    )


def study_pool(place: Workplace) -> Pool:
    """Load the study's candidates; raises PlancurateError when there are none."""
    targets = range(place.config.n_targets)
    return load_pool(place.lake, place.partition, targets=targets, planners=place.config.planners)


def study_selections(place: Workplace, pool: Pool) -> list[Selection]:
    """Return the study's selections in the order of its selectors and budgets, making those that are missing."""
    config = place.config
    return [
        make_selection(place, pool, name, budget)
        for name in config.selectors
        for budget in budgets(name, config)
    ]


def budgets(selector: str, config: StudyConfig) -> tuple[int | None, ...]:
    """Return the budgets to run a selector with; None once for one that keeps everything."""
    return config.budgets if find_selector(selector).budgeted else (None,)
