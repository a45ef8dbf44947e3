"""A study's selections: which there are, and how one is made or found."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from plancurate.errors import PlancurateError
from plancurate.tasks.curation.curate import curate, wanted_id
from plancurate.tasks.curation.names import label
from plancurate.tasks.curation.pool import Pool, load_pool
from plancurate.tasks.curation.selector_choice import SelectorChoice
from plancurate.tasks.curation.selectors.selection import Selection
from plancurate.tasks.study.context import PoolContext, StudyContext


@dataclass(frozen=True)
class WantedSelection:
    """One selection of a study: what to select from, how, how much and with which seed."""

    pool: str
    pool_hash: str
    """Of the content of the loaded pool: a selection is never made from other candidates unnoticed."""
    choice: SelectorChoice
    budget: int | None
    seed: int
    selection_id: str

    @property
    def title(self) -> str:
        """Name the selection for a person."""
        return label(self.choice.label, self.budget)


def study_pool(study: StudyContext, pool: PoolContext) -> Pool:
    """Load a study's candidates of one pool; raises PlancurateError when there are none."""
    targets = range(study.config.n_targets)
    planners, labelling = study.sources, study.labelling
    return load_pool(study.lake, pool.partition, targets=targets, planners=planners, labelling=labelling)


def wanted_selections(study: StudyContext, pool: PoolContext, loaded: Pool) -> list[WantedSelection]:
    """Return the selections of one pool in the order of the study's selectors, budgets and selection seeds."""
    learning = pool.learning(study.config)
    return [
        WantedSelection(
            pool.pool, loaded.hash, choice, budget, seed, wanted_id(loaded, choice, budget, seed, learning)
        )
        for choice in study.config.selectors
        if applies(choice, pool)
        for budget in budgets(choice, study.config.budgets)
        for seed in selection_seeds(choice, study.config.selection_seeds)
    ]


def study_selections(study: StudyContext) -> list[WantedSelection]:
    """Return the selections of all pools, pool by pool; PlancurateError when a pool is empty."""
    return [
        wanted for pool in study.pools for wanted in wanted_selections(study, pool, study_pool(study, pool))
    ]


def applies(choice: SelectorChoice, pool: PoolContext) -> bool:
    """Say whether a selector can select from a pool: those that roll out, train or time do so in one scene."""
    return pool.family is None or not choice.selector.uses


def budgets(choice: SelectorChoice, asked: tuple[int, ...]) -> tuple[int | None, ...]:
    """Return the budgets to run a selector with; None once for one that keeps what it keeps."""
    return asked if choice.selector.budgeted else (None,)


def selection_seeds(choice: SelectorChoice, asked: tuple[int, ...]) -> tuple[int, ...]:
    """Return the seeds to run a selector with; the first alone for one that never draws."""
    return asked if choice.selector.seeded else asked[:1]


@lru_cache(maxsize=64)  # many networks learn from one selection, and each read looks through the lake
def make_selection(study: StudyContext, wanted: WantedSelection) -> Selection:
    """Return a selection, made now or found in the lake."""
    pool = study.pool(wanted.pool)
    return curate(
        study.lake,
        _loaded(study, wanted.pool, wanted.pool_hash),
        study.study,
        wanted.choice,
        wanted.budget,
        wanted.seed,
        robot=pool.robot,
        scene=pool.scene,
        learning=pool.learning(study.config),
        metadata=study.metadata,
    )


@lru_cache(maxsize=2)  # selections of a pool follow each other, and loading takes longer than most of them
def _loaded(study: StudyContext, pool: str, pool_hash: str) -> Pool:
    loaded = study_pool(study, study.pool(pool))
    if loaded.hash != pool_hash:
        raise PlancurateError(f"pool {pool}: its candidates changed while the study selected; start it again")
    return loaded
