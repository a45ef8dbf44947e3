"""Put a study's report together: which tables and figures, in which order, under which headings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from plancurate.tasks.report import failure_table, figures, measured_figures, selection_tables, tables
from plancurate.tasks.report.contents import Report, Section, Table
from plancurate.tasks.report.development import development_section
from plancurate.tasks.report.setup import setup
from plancurate.tasks.report.source import FRESH_TITLES, Source
from plancurate.tasks.study import text
from plancurate.tasks.study.agreement import agreement_sentence
from plancurate.tasks.study.results import StudyResults
from plancurate.tasks.study.trial_results import Kind
from plancurate.tasks.study.verdict import verdicts

SELECTION = (
    "A selection is the trajectories that a selector keeps of all candidates, k for each target. Each selection trains "
    "the same policies, and a test sends a policy to one target. Success: the tool comes within 5 cm of it, and every "
    "move up to then is free of collision and inside the limits. Settled: it is still there at the step limit."
)
FRESH: Mapping[Kind, tuple[str, str]] = {
    "unseen": (
        "fresh",
        "Targets that no policy was trained on; the publication has no such tests.",
    ),
    "unseen_scene": (
        "fresh_scenes",
        "Each test is in a scene of its own, drawn like those that policies were trained in and not one of them. "
        "Selectors that roll policies out or time trajectories do so in one scene, so they are not here.",
    ),
}
"""Of each kind of fresh targets: the section's key, and what they are."""
HOW_SURE = (
    "The 95 % interval says what the rate might be with other seeds and test targets. A gain over General, which keeps "
    "every candidate, is sure (stars) where such chance does not explain it; selections that chance may have ordered "
    "are ties."
)


def build_report(results: StudyResults, pictures: Section | None = None) -> Report:
    """The report of a study's results, with a section of pictures where one was made."""
    sources = {kind: Source(results, kind) for kind in results.tests}
    headline, displaced = sources[results.headline.kind], sources.get("displaced")
    sections = [
        *(fresh_targets(sources[kind]) for kind in FRESH if kind in sources),
        *(displaced_targets(displaced) if displaced else []),
        *([pictures] if pictures else []),
        selections(headline),
        reasons(headline),
        *(agreement(displaced) if displaced else []),
        development_section(),
    ]
    verdict = [sentence for one in verdicts(results) for sentence in one.sentences]
    return Report(results.study.name, verdict, overview(results), sections, setup(results))


def fresh_targets(source: Source) -> Section:
    """Success at targets that no policy was trained on, in scenes that it was trained in or in others."""
    key, words = FRESH[source.kind]
    words = f"{words} {SELECTION} {HOW_SURE}{degenerate_pools(source.results)}"
    drawn = [figures.fresh_bars(source), *filter(None, [figures.scene_map(source)])]
    shown = [tables.success_table(source), failure_table.failure_table(source)]
    return Section(key, FRESH_TITLES[source.kind], words, drawn, shown)


def displaced_targets(source: Source) -> list[Section]:
    """The publication's tests: success by selector, policy and distance, and how the rollouts went."""
    words = (
        "Tests at the trained targets and up to 5 cm from them, as in the publication, where a planner reaches them; "
        f"{source.results.dropped_tests} of them are left out."
    )
    if source.results.headline.kind == "displaced":
        words = f"{words} {SELECTION} {HOW_SURE}"
    words += degenerate_pools(source.results)
    drawn = [
        figures.success_bars(source),
        figures.success_forest(source),
        figures.scene_map(source),
        figures.budget_curves(source),
    ]
    return [
        Section(
            "success", "Success by selector", words, [f for f in drawn if f], [tables.success_table(source)]
        ),
        Section(
            "policies", "Success by policy", "", [figures.policy_map(source)], [tables.policy_table(source)]
        ),
        Section(
            "distances",
            "Success by distance",
            "",
            [figures.distance_curves(source)],
            [tables.distance_table(source)],
        ),
        Section(
            "quality",
            "Quality of the rollouts",
            "A rollout is one run of a policy towards one test target.",
            [measured_figures.quality_bars(source), measured_figures.quality_forest(source)],
            [tables.quality_table(source), failure_table.failure_table(source)],
        ),
    ]


def selections(source: Source) -> Section:
    """What the selections hold and what they cost."""
    shown: list[Table[Any]] = [
        selection_tables.time_table(source),
        selection_tables.coverage_table(source),
        selection_tables.planners_table(source),
        selection_tables.pool_table(source),
    ]
    if source.results.rankings:
        shown.append(selection_tables.ranking_table(source))
    words = " ".join(text.unsteady(row) for row in source.results.rankings if row.unsteady)
    return Section("selections", "The selections", words, [measured_figures.time_forest(source)], shown)


def reasons(source: Source) -> Section:
    """Why selections do well or badly."""
    below = selection_tables.below_random_table(source)
    words = "A policy that is shown two ways to one place learns neither."
    return Section(
        "reasons", "Reasons", words, [measured_figures.ways_figure(source)], [below] if below.rows else []
    )


def agreement(source: Source) -> Iterator[Section]:
    """The publication's gains beside ours, where the study has General and a published selector."""
    rows = source.tests.agreement
    if rows:
        words = agreement_sentence(source.figure_rows(rows))
        table = selection_tables.agreement_table(source)
        yield Section("publication", "Agreement with the publication", words, tables=[table])


def degenerate_pools(results: StudyResults) -> str:
    """What to know beside results from degenerate pools, to follow another sentence; empty where there are none."""
    return "".join(f" {text.degenerate(pool)}" for pool in results.pools if pool.degenerate)


def overview(results: StudyResults) -> str:
    """What the study covers."""
    study, tests = results.study, results.headline
    scenes = list(dict.fromkeys(pool.scene for pool in study.pools))
    chosen = {(row.selector, row.budget) for row in tests.summaries}
    return (
        f"Robot {study.robot} in {'scene' if len(scenes) == 1 else 'scenes'} {', '.join(scenes)}: "
        f"{study.pools[0].n_targets} training targets, {len(chosen)} selections, {len(tests.networks)} networks."
    )
