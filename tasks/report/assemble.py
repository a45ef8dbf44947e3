"""Put a study's report together: which tables and figures, in which order, under which headings."""

from __future__ import annotations

from typing import Any

from plancurate.tasks.curation.selectors.selection import label
from plancurate.tasks.lake import Lake
from plancurate.tasks.report import agreement, figures, text
from plancurate.tasks.report.contents import Report, Section
from plancurate.tasks.report.pool_tables import coverage_table, planners_table, time_table
from plancurate.tasks.report.setup import setup
from plancurate.tasks.report.source import Source, is_base
from plancurate.tasks.report.tables import distance_table, policy_table, quality_table, success_table
from plancurate.tasks.report.ways import below_random_table, ways_figure
from plancurate.tasks.study.statistics import wilson_interval


def build_report(lake: Lake, study: str) -> Report:
    """The report of a study, by its full or plain name; UnknownNameError when it has no trials."""
    source = Source(lake, study)
    sections = [
        success(source),
        policies(source),
        distances(source),
        *fresh_targets(Source(lake, source.study, "unseen")),
        quality(source),
        selections(source),
        reasons(source),
        *agreement_section(source),
    ]
    return Report(source.recorded.get("study", source.study), summary(source), sections, setup(source))


def success(source: Source) -> Section:
    """Which selector is best."""
    table = success_table(source)
    drawn = [
        figures.success_bars(source, table.rows),
        figures.success_forest(source, table.rows),
        figures.budget_curves(source, table.rows),
    ]
    return Section("success", "Success by selector", "", [figure for figure in drawn if figure], [table])


def policies(source: Source) -> Section:
    """Which policy makes the most of which selection."""
    table = policy_table(source)
    return Section("policies", "Success by policy", "", [figures.policy_map(source, table.rows)], [table])


def distances(source: Source) -> Section:
    """How far from the trained targets the policies still arrive."""
    table = distance_table(source)
    drawn = [figures.distance_curves(source, table.rows)]
    return Section("distances", "Success by distance", "", drawn, [table])


def fresh_targets(source: Source) -> list[Section]:
    """Success at targets that no policy was trained on, where the study has such tests."""
    if not source.order:
        return []
    words = "Targets anywhere in the cube that no policy was trained on. The publication has no such tests."
    return [Section("fresh", "Success at fresh targets", words, tables=[success_table(source)])]


def quality(source: Source) -> Section:
    """How the rollouts went."""
    table = quality_table(source)
    drawn = [figures.quality_bars(source, table.rows), figures.quality_forest(source, table.rows)]
    return Section("quality", "Quality of the rollouts", "", drawn, [table])


def selections(source: Source) -> Section:
    """What the selections hold and what they cost."""
    times = time_table(source)
    return Section(
        "selections",
        "The selections",
        "",
        [figures.time_forest(source, times.rows)],
        [times, coverage_table(source), planners_table(source)],
    )


def reasons(source: Source) -> Section:
    """Why selections do well or badly."""
    below = below_random_table(source)
    text = "A policy that is shown two ways to one place learns neither."
    return Section("reasons", "Reasons", text, [ways_figure(source)], [below] if below.rows else [])


def agreement_section(source: Source) -> list[Section]:
    """The publication's gains beside ours, where the study has General and a published selector."""
    table = agreement.agreement_table(source)
    if not table.rows:
        return []
    return [Section("publication", "Agreement with the publication", "", tables=[table])]


def summary(source: Source) -> list[str]:
    """The report in a few sentences."""
    rows = source.rows("by_selector")
    best = [row for row in rows if row["successes"] / row["n"] == rows[0]["successes"] / rows[0]["n"]]
    names = ", ".join(label(row["selector"], row["budget"]) for row in best)
    sentences = [f"Best: {names} with {rate(best[0])} of {best[0]['n']} tests successful."]
    sentences += [f"General, which keeps every candidate: {rate(row)}." for row in rows if is_base(row)]
    compared = [
        row for row in agreement.agreement_rows(source) if (row.selector, row.budget) in source.largest
    ]
    return [" ".join(sentences), *filter(None, [agreement.summary(compared)]), scope(source)]


def rate(row: dict[str, Any]) -> str:
    """A success rate with its interval."""
    interval = wilson_interval(row["successes"], row["n"])
    return f"{text.percent(row['successes'] / row['n'])} % {text.percents(interval)}"


def scope(source: Source) -> str:
    """What the study covers."""
    networks = len(source.rows("by_policy"))
    found = source.recorded
    place = f"Robot {found['robot']} in scene {found['scene']}: " if found else ""
    targets = f"{source.config['n_targets']} training targets, " if source.config else ""
    return f"{place}{targets}{len(source.order)} selections, {networks} trained networks."
