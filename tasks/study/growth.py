"""A study that grows by training targets or by runs to each, its tests at fresh targets unchanged."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, get_args

from plancurate.errors import PlancurateError
from plancurate.tasks.lake.home import Home
from plancurate.tasks.study.config import MOST_TARGETS, GrowBy, StudyConfig
from plancurate.tasks.study.context import StudyContext, open_study
from plancurate.tasks.study.evaluations import missing_evaluations


@dataclass(frozen=True)
class Dimension:
    """What of a study grows."""

    words: str
    """What is counted, for a person."""
    field: tuple[str, ...]
    """Where a configuration says how many."""
    resized: Callable[[StudyContext, int], StudyContext]
    """The same study with so many."""

    def size(self, config: StudyConfig) -> int:
        """How many a study has."""
        return self.recorded(config.model_dump())

    def recorded(self, config: Mapping[str, Any]) -> int:
        """How many a study has whose configuration was read from the lake."""
        value: Any = config
        for name in self.field:
            value = value[name]
        return int(value)


def with_targets(study: StudyContext, n_targets: int) -> StudyContext:
    """Return the same study with another number of training targets."""
    return replace(study, config=study.config.model_copy(update={"n_targets": n_targets}))


def with_runs(study: StudyContext, runs: int) -> StudyContext:
    """Return the same study with another number of runs to each target, which makes its pools other ones."""
    plan = study.config.candidates.plan.model_copy(update={"runs": runs})
    candidates = study.config.candidates.model_copy(update={"plan": plan})
    config = study.config.model_copy(update={"candidates": candidates})
    return replace(study, config=config, pools=tuple(pool.with_runs(runs) for pool in study.pools))


DIMENSIONS: Mapping[GrowBy, Dimension] = {
    "targets": Dimension("training targets", ("n_targets",), with_targets),
    "runs": Dimension("runs of each planner to a target", ("candidates", "plan", "runs"), with_runs),
}


def grown(config: StudyConfig, home: Home, more: int, by: GrowBy = "targets") -> StudyConfig:
    """Return a study's configuration with so many targets or runs more than when it was last run to its end.

    What was stopped half-way is gone on with first. Where it has not run yet, it begins as it is configured.
    PlancurateError for a negative number, or for more targets than a study may have.
    """
    if more < 0:
        raise PlancurateError(f"grow = {more}: a number of {by} to add is needed, 0 or more")
    if more == 0:
        return config
    if by == "runs" and (
        fixed := [label for label in config.pools if "runs" in config.pools[label].get("plan", {})]
    ):
        raise PlancurateError(f"grow_by = runs: pools.{fixed[0]}.plan.runs says how many; take it out")
    dimension, study = DIMENSIONS[by], open_study(config, home)
    known = known_sizes(study, by)
    if not known:
        return config
    last = dimension.resized(study, known[-1])
    if missing_evaluations(last):
        return last.config
    wanted = max(known[-1] + more, dimension.size(config))
    if by == "targets" and wanted > MOST_TARGETS:
        raise PlancurateError(
            f"grow = {more}: study {config.name} has {known[-1]} targets; at most {MOST_TARGETS} are possible"
        )
    return dimension.resized(study, wanted).config


def smaller(study: StudyContext) -> tuple[GrowBy, StudyContext] | None:
    """Return the largest study below this one that was tested and differs in its size alone, and in which size.

    None where there is none; by targets first, where it grew by both.
    """
    for by in get_args(GrowBy):
        dimension = DIMENSIONS[by]
        if below := [size for size in known_sizes(study, by) if size < dimension.size(study.config)]:
            return by, dimension.resized(study, below[-1])
    return None


def known_sizes(study: StudyContext, by: GrowBy = "targets") -> list[int]:
    """Return with how many targets or runs each, ascending, the same study has trials in the lake."""
    if not study.lake.root.is_dir():
        return []
    rows = study.lake.query_sound("results/studies").to_pylist()
    own = {row["study"]: json.loads(row["config"]) for row in rows if row["name"] == study.config.name}
    dimension = DIMENSIONS[by]
    sizes = {name: dimension.recorded(config) for name, config in own.items()}
    return sorted(size for name, size in sizes.items() if dimension.resized(study, size).study == name)
