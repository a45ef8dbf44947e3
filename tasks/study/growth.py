"""A study that grows: the same study with more training targets each time, its tests at fresh targets unchanged."""

from __future__ import annotations

from dataclasses import replace

from plancurate.errors import PlancurateError
from plancurate.tasks.lake.home import Home
from plancurate.tasks.study.config import MOST_TARGETS, StudyConfig
from plancurate.tasks.study.context import StudyContext, open_study
from plancurate.tasks.study.evaluations import missing_evaluations


def grown(config: StudyConfig, home: Home, more: int) -> StudyConfig:
    """Return a study's configuration with so many training targets more than when it was last run to its end.

    What was stopped half-way is gone on with first. Where it has not run yet, it begins as it is configured.
    PlancurateError for a negative number, or for more targets than a study may have.
    """
    if more < 0:
        raise PlancurateError(f"grow = {more}: a number of targets to add is needed, 0 or more")
    if more == 0:
        return config
    study = open_study(config, home)
    known = known_sizes(study)
    if not known:
        return config
    last = with_targets(study, known[-1])
    if missing_evaluations(last):
        return last.config
    wanted = max(known[-1] + more, config.n_targets)
    if wanted > MOST_TARGETS:
        raise PlancurateError(
            f"grow = {more}: study {config.name} has {known[-1]} targets; at most {MOST_TARGETS} are possible"
        )
    return with_targets(study, wanted).config


def smaller(study: StudyContext) -> StudyContext | None:
    """Return the same study with the most training targets below its own that was tested; None where there is none."""
    known = [size for size in known_sizes(study) if size < study.config.n_targets]
    return with_targets(study, known[-1]) if known else None


def known_sizes(study: StudyContext) -> list[int]:
    """Return with how many training targets each, ascending, the same study has trials in the lake."""
    if not study.lake.root.is_dir():
        return []
    rows = study.lake.query_sound("results/studies").to_pylist()
    own = [row for row in rows if row["name"] == study.config.name]
    return sorted(
        row["n_targets"] for row in own if with_targets(study, row["n_targets"]).study == row["study"]
    )


def with_targets(study: StudyContext, n_targets: int) -> StudyContext:
    """Return the same study with another number of training targets."""
    return replace(study, config=study.config.model_copy(update={"n_targets": n_targets}))
