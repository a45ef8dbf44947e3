"""Result rows as tables: for the terminal, Markdown and JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from rich.table import Table

from plancurate.tasks.study import text
from plancurate.tasks.study.reference_results import ReferenceRow, of_group
from plancurate.tasks.study.rows import ALL_SCENES, PolicyRow, ResultRow, SummaryRow
from plancurate.tasks.study.trial_results import KindResults

ONLY_IF_SEVERAL = ("scene", "pool_label", "kind", "selection_seed", "round")
"""Columns of the printed rows that are left out where all rows have the same value."""
ONLY_IF_ANY = ("hard_n", "hard_successes", "hard_settled")
"""Columns that are left out where no row has a hard trial."""


def matrix(tests: KindResults, title: str) -> Table:
    """Success in percent, a row a selection, best first; 80 characters wide.

    A column for each policy, or for each scene (and variant of candidates) where there are several.
    """
    shown = Table(title=title, title_justify="left", box=None, padding=(0, 1, 0, 0), header_style="bold")
    columns = matrix_columns(tests)
    names = [
        column.removeprefix("BC_").replace("RNN_", "RNN_\n").replace("Dropout", "Drop-\nout")
        for column in columns
    ]
    for column in ("selector", "k", *names, total(tests), "set-\ntled", "hard"):
        shown.add_column(column, justify="left" if column == "selector" else "right", no_wrap=True)
    for summary in lines(tests):
        cells = matrix_cells(tests, summary, columns)
        overall = (
            f"[bold]{text.percent(summary.success_rate)}[/] {stars(summary):<3} "
            f"[dim]\\{text.whole_percents(summary.interval)}[/]"
        )
        settled, hard = text.percent(summary.settled_rate), text.percent(summary.hard_rate)
        shown.add_row(summary.selector, text.budget(summary.budget), *cells, overall, settled, hard)
    for reference in references(tests):
        cells = reference_rates(tests, reference, columns)
        rate, hard = text.percent(reference.success_rate), text.percent(reference.hard_rate)
        overall = f"{rate}     [dim]\\{text.whole_percents(reference.interval)}[/]"
        shown.add_row(reference.reference, text.NOTHING, *cells, overall, rate, hard, style="italic")
    return shown


def matrix_markdown(tests: KindResults) -> str:
    """The matrix of success rates (percent) as Markdown."""
    columns = matrix_columns(tests)
    selections = [
        {
            "selector": summary.selector,
            "k": text.budget(summary.budget),
            **dict(zip(columns, matrix_cells(tests, summary, columns), strict=True)),
            total(tests): text.percent(summary.success_rate),
            "95 % interval": text.percents(summary.interval),
            "vs General": stars(summary),
            "settled": text.percent(summary.settled_rate),
            "hard": text.percent(summary.hard_rate),
            "hard n": summary.hard_n,
        }
        for summary in lines(tests)
    ]
    others = [
        {
            "selector": reference.reference,
            "k": text.NOTHING,
            **dict(zip(columns, reference_rates(tests, reference, columns), strict=True)),
            total(tests): text.percent(reference.success_rate),
            "95 % interval": text.percents(reference.interval),
            "vs General": "",
            "settled": text.percent(reference.success_rate),
            "hard": text.percent(reference.hard_rate),
            "hard n": reference.hard_n,
        }
        for reference in references(tests)
    ]
    return as_markdown([*selections, *others])


def lines(tests: KindResults) -> list[SummaryRow]:
    """The selections of the first group: over all scenes where there are several."""
    first = tests.summaries[0].group
    return [row for row in tests.summaries if row.group == first]


def references(tests: KindResults) -> list[ReferenceRow]:
    """What is set beside the selections of the first group."""
    return list(of_group(tests.references, tests.summaries[0].group).values())


def reference_rates(tests: KindResults, reference: ReferenceRow, columns: Sequence[str]) -> list[str]:
    """A reference's success rate in each scene and variant; nothing for policies, which it has none of."""
    rates = {
        row.group_title: text.percent(row.success_rate)
        for row in tests.references
        if row.reference == reference.reference
    }
    return [rates.get(column, "") for column in columns]


def total(tests: KindResults) -> str:
    """What a line's own rate, interval and stars are over."""
    groups = {row.group for row in tests.summaries}
    return "all policies" if len(groups) == 1 else tests.summaries[0].group_title


def matrix_columns(tests: KindResults) -> list[str]:
    """Policies, or scenes and variants where there are several."""
    if len({row.group for row in tests.summaries}) == 1:
        return sorted({row.policy for row in tests.policies})
    return list(dict.fromkeys(row.group_title for row in tests.summaries if row.scene != ALL_SCENES))


def matrix_cells(tests: KindResults, selection: SummaryRow, columns: Sequence[str]) -> list[str]:
    """A selection's success rate in each column."""
    rows: list[PolicyRow] | list[SummaryRow] = tests.policies
    if len({row.group for row in tests.summaries}) > 1:
        rows = tests.summaries
    rates = {
        row.group_title if isinstance(row, SummaryRow) else row.policy: row.success_rate
        for row in rows
        if (row.selector, row.budget) == (selection.selector, selection.budget)
    }
    return [text.percent(rates.get(column)) for column in columns]


def stars(row: SummaryRow) -> str:
    """Stars of the gain over General."""
    return row.gain.stars if row.gain else ""


def as_json(rows: Sequence[ResultRow]) -> str:
    """Result rows as a JSON list."""
    return json.dumps([row.report() for row in rows], indent=1)


def report_markdown(rows: Sequence[ResultRow]) -> str:
    """Result rows as a Markdown table, without columns that say nothing."""
    records = [row.report() for row in rows]
    needless = {name for name in ONLY_IF_SEVERAL if len({record[name] for record in records}) == 1}
    if not any(row.hard_n for row in rows):
        needless |= set(ONLY_IF_ANY)
    return as_markdown(
        [{name: value for name, value in record.items() if name not in needless} for record in records]
    )


def as_markdown(rows: Sequence[Mapping[str, Any]]) -> str:
    """Rows of the same fields as a Markdown table."""
    names = list(rows[0])
    lines = ["| " + " | ".join(names) + " |", "|" + " --- |" * len(names)]
    lines += ["| " + " | ".join(cell(name, row[name]) for name in names) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def cell(name: str, value: Any) -> str:
    """One value for a reader."""
    if name == "budget":
        return text.budget(value)
    return f"{value:.4g}" if isinstance(value, float) else str(value)
