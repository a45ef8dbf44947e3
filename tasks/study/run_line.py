"""What a run of a study did, in one line."""

from __future__ import annotations

from collections.abc import Sequence

from plancurate.tasks.study import text
from plancurate.tasks.study.against import SURE
from plancurate.tasks.study.comparison import RateDifference, compare_studies
from plancurate.tasks.study.context import StudyContext
from plancurate.tasks.study.growth import DIMENSIONS, smaller
from plancurate.tasks.study.results import KINDS


def held_evaluations(study: StudyContext) -> frozenset[str]:
    """Return the ids of the evaluations that the lake holds of a study."""
    return frozenset(
        key for pool in study.pools for key in study.lake.keys("evaluations", study.study_partition(pool))
    )


def run_line(study: StudyContext, tested_before: frozenset[str], champions: Sequence[str]) -> str:
    """Say what a run that began with those tests did, and what became of the champions."""
    made = len(held_evaluations(study) - tested_before)
    if not made:
        said = f"nothing to do, all {len(tested_before)} networks were tested before; `grow` adds targets or runs"
    elif tested_before:
        said = f"went on, {made} of {made + len(tested_before)} networks tested now"
    else:
        networks = "1 network" if made == 1 else f"{made} networks"
        said = f"{study.config.n_targets} training targets, {networks} tested"
        if grew := growth_line(study):
            said = f"{said}; {grew}"
    return "; ".join([f"{study.study}: {said}", *champions])


def growth_line(study: StudyContext) -> str | None:
    """Say what the targets or runs did that the study has more than when it was smaller; None where it never was."""
    found = smaller(study)
    if found is None:
        return None
    by, before = found
    size, words = DIMENSIONS[by].size(before.config), DIMENSIONS[by].words
    for kind in KINDS:
        if rows := compare_studies(study.lake, before.study, study.study, kind).results:
            return f"{difference_line(rows[0])} ({size} {words} before, {kind} tests)"
    return f"no test in common with {before.study}"


def difference_line(row: RateDifference) -> str:
    """Say how the selection that was best before does now, and whether that is more than chance."""
    chance = "it may be chance" if row.p >= SURE else "better" if row.difference > 0 else "worse"
    return (
        f"{row.name} from {text.percent(row.a.rate)} to {text.percent(row.b.rate)} %, "
        f"{text.points(row.difference)} points {text.percents(row.interval)}, {text.p_value(row.p)}, {chance}"
    )
