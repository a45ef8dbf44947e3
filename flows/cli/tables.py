"""Result rows as tables: for the terminal, Markdown and JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from rich.table import Table

from plancurate.tasks.study.results import ResultRow, SummaryRow

PERCENT = ("success_rate", "ci_low", "ci_high", "settled_rate")


def matrix(rows: Sequence[ResultRow], summaries: Sequence[SummaryRow], title: str) -> Table:
    """Success in percent, a row a selection and a column a policy, best selection first; 80 characters wide."""
    shown = Table(title=title, title_justify="left", box=None, padding=(0, 1, 0, 0), header_style="bold")
    policies = sorted({row.policy for row in rows})
    names = [
        policy.removeprefix("BC_").replace("RNN_", "RNN_\n").replace("Dropout", "Drop-\nout")
        for policy in policies
    ]
    for column in ("selector", "k", *names, "all policies", "set-\ntled"):
        shown.add_column(column, justify="left" if column == "selector" else "right", no_wrap=True)
    for summary in summaries:
        cells = [percent(rate(rows, summary, policy)) for policy in policies]
        low, high = 100 * summary.ci_low, 100 * summary.ci_high
        overall = f"[bold]{percent(summary.success_rate)}[/] {summary.stars or '':<3} [dim]\\[{low:.0f},{high:.0f}][/]"
        shown.add_row(summary.selector, budget(summary), *cells, overall, percent(summary.settled_rate))
    return shown


def rate(rows: Sequence[ResultRow], selection: SummaryRow, policy: str) -> float:
    """Success rate of a policy on a selection over all its seeds."""
    chosen = [
        row
        for row in rows
        if (row.selector, row.budget, row.policy) == (selection.selector, selection.budget, policy)
    ]
    return sum(row.successes for row in chosen) / sum(row.n for row in chosen)


def budget(row: ResultRow | SummaryRow) -> str:
    """Budget in words."""
    return "all" if row.budget is None else str(row.budget)


def percent(share: float) -> str:
    """Share in percent."""
    return f"{100 * share:.1f}"


def as_json(rows: Sequence[ResultRow]) -> str:
    """Result rows as a JSON list."""
    return json.dumps([row.report() for row in rows], indent=1)


def as_markdown(rows: Sequence[Mapping[str, Any]]) -> str:
    """Rows of the same fields as a Markdown table."""
    names = list(rows[0])
    lines = ["| " + " | ".join(names) + " |", "|" + " --- |" * len(names)]
    lines += ["| " + " | ".join(cell(name, row[name]) for name in names) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def matrix_markdown(rows: Sequence[ResultRow], summaries: Sequence[SummaryRow]) -> str:
    """The matrix of success rates (percent) as Markdown."""
    policies = sorted({row.policy for row in rows})
    return as_markdown(
        [
            {
                "selector": summary.selector,
                "k": budget(summary),
                **{policy: percent(rate(rows, summary, policy)) for policy in policies},
                "all policies": percent(summary.success_rate),
                "95 % interval": f"{percent(summary.ci_low)} to {percent(summary.ci_high)}",
                "vs General": summary.stars or "",
                "settled": percent(summary.settled_rate),
            }
            for summary in summaries
        ]
    )


def cell(name: str, value: Any) -> str:
    """One value for a reader."""
    if value is None:
        return "all" if name == "budget" else ""
    return f"{value:.4g}" if isinstance(value, float) else str(value)
