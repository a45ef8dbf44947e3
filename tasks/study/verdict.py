"""What a study says, in sentences for a newcomer: which selection, how sure that is, what to do next."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from plancurate.tasks.study import text
from plancurate.tasks.study.against import BASELINE, SURE
from plancurate.tasks.study.reference_results import (
    PLANNER,
    REPLAY,
    STRAIGHT_LINE,
    ReferenceRow,
    of_group,
)
from plancurate.tasks.study.results import StudyResults
from plancurate.tasks.study.rows import ALL_SCENES, SummaryRow
from plancurate.tasks.study.selection_rows import PoolRow

TESTS = {
    "unseen": "tests at targets that no policy was trained on",
    "unseen_scene": "tests in scenes that no policy was trained in",
    "displaced": "tests at targets up to 5 cm from a trained one",
}
NAMED = 4
"""Ties that are named one by one."""


@dataclass(frozen=True)
class Verdict:
    """One scene's verdict, or that over all of several scenes."""

    best: list[SummaryRow]
    """The best selection and those that the tests can't tell from it."""
    which: str
    sure: str
    ceiling: str
    """How far from a planner; empty where no planner was asked."""
    steps: list[str]
    """What to do next."""

    @property
    def sentences(self) -> list[str]:
        """All of it, the most important first."""
        return [self.which, self.sure, *([self.ceiling] if self.ceiling else []), *self.steps]


def verdicts(results: StudyResults) -> list[Verdict]:
    """One verdict for each variant of candidates: over all scenes where there are several."""
    summaries = results.headline.summaries
    groups = dict.fromkeys(row.group for row in summaries)
    shown = [group for group in groups if group[0] == ALL_SCENES] or list(groups)
    return [_verdict(results, [row for row in summaries if row.group == group]) for group in shown]


def _verdict(results: StudyResults, rows: Sequence[SummaryRow]) -> Verdict:
    best = [row for row in rows if row.best]
    general = next((row for row in rows if row.selector == BASELINE), None)
    steps = [
        *reading_steps(results.study.config),
        *pool_steps(results.pools),
        *seed_steps(rows),
        *choice_steps(results, best),
    ]
    several = len({row.group for row in results.headline.summaries}) > 1
    where = f"{text.group(best[0])}: " if several else ""
    known = of_group(results.headline.references, best[0].group)
    said = where + which(best, TESTS[results.headline.kind])
    return Verdict(best, said, sure(best[0], general), ceiling(best[0], known), steps)


def reading_steps(config: Mapping[str, Any]) -> Iterator[str]:
    """What to know of a study whose policies learn from one cluster each."""
    if config.get("one_policy_a") == "cluster":
        yield (
            "Selections that cluster have a policy for each cluster, and each test is answered by that of the nearest "
            "one (one_policy_a: cluster); without that option one policy learns from all that a selection keeps."
        )


def which(best: Sequence[SummaryRow], tests: str) -> str:
    """Which selection is best; ties are named as ties."""
    first = best[0]
    rate = f"{text.percent(first.success_rate)} % {text.percents(first.interval)}"
    if len(best) == 1:
        return f"{first.name} is the best selection: {rate} of {first.n} {tests} succeed."
    names = ", ".join(row.name for row in best[:NAMED])
    more = f" and {len(best) - NAMED} more" if len(best) > NAMED else ""
    last = text.percent(min(row.success_rate for row in best))
    return (
        f"{len(best)} selections tie for the best: {names}{more}. {first.name} leads with {rate} of {first.n} {tests}; "
        f"the tests can't tell it from the others, down to {last} %."
    )


def sure(first: SummaryRow, general: SummaryRow | None) -> str:
    """How sure it is that the first selection helps, and what its interval covers."""
    covered = f"The 95 % interval in brackets covers other {first.interval_over}."
    if general is None:
        return f"General, which keeps every candidate, was not tested, so whether selecting helps is open. {covered}"
    if first.gain is None:
        return f"No selection beats General, which keeps every candidate. {covered}"
    gain = f"{text.points(first.gain.value)} points {text.percents(first.gain.interval)}"
    chance = "more than chance" if first.gain.holm_p < SURE else "it may be chance"
    return (
        f"General, which keeps every candidate, reaches {text.percent(general.success_rate)} %: {gain}, "
        f"{text.p_value(first.gain.holm_p)}, {chance}. {covered}"
    )


def ceiling(first: SummaryRow, references: Mapping[str, ReferenceRow]) -> str:
    """How far the first selection is from a planner, and what is reached without learning."""
    if PLANNER not in references:
        return ""
    planner, line = references[PLANNER], references[STRAIGHT_LINE]
    rates = [text.percent(references[name].success_rate) for name in (PLANNER, STRAIGHT_LINE, REPLAY)]
    said = (
        f"A planner reaches {rates[0]} % of these {planner.n} targets, "
        f"{text.distance(planner.success_rate - first.success_rate)} {first.name}; a straight line in joint space "
        f"{rates[1]} %, the best trajectory to the nearest training target {rates[2]} %."
    )
    if not line.hard_n:
        return said
    return (
        f"{said} At the hard targets, whose straight line is not free ({line.hard_n} of {line.n}), {first.name} "
        f"reaches {text.percent(first.hard_rate)} %, a planner {text.percent(planner.hard_rate)} %."
    )


def pool_steps(pools: Sequence[PoolRow]) -> Iterator[str]:
    """What to do about pools that hold copies."""
    for pool in pools:
        if pool.degenerate:
            yield f"{text.degenerate(pool)} Plan with less simplification or other goals."


def seed_steps(rows: Sequence[SummaryRow]) -> Iterator[str]:
    """What to do about levels of chance that the study does not show."""
    if max(row.selection_seeds for row in rows) == 1:
        yield "Every selection was drawn once; several `selection_seeds` would show what another draw changes."
    if max(row.training_seeds for row in rows) == 1:
        yield "Every network was trained once; several `seeds` would show what another training changes."


def choice_steps(results: StudyResults, best: Sequence[SummaryRow]) -> Iterator[str]:
    """What to do with the best selection, or with several of them."""
    chosen = min(best, key=lambda row: row.selection_time_s) if len(best) > 1 else best[0]
    if len(best) > 1:
        yield (
            f"More targets and seeds would tell the ties apart. Of them {chosen.name} takes the least time to select "
            f"({text.seconds(chosen.selection_time_s)} s)."
        )
    budget = "budget IS NULL" if chosen.budget is None else f"budget = {chosen.budget}"
    yield (
        "Its trajectories: SELECT * FROM selections "
        f"WHERE study = '{results.study.study}' AND selector = '{chosen.selector}' AND {budget}"
    )
