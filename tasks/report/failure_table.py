"""Why rollouts failed: what they collided with, whose limits they broke, how many came to nothing."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

from plancurate.tasks.report.contents import Table
from plancurate.tasks.report.source import Source
from plancurate.tasks.study import text
from plancurate.tasks.study.rows import Cell, FailureRow


def failure_table(source: Source) -> Table[FailureRow]:
    """Each selection's failures by their kind, with the commonest contact and the commonest limit."""
    reasons: dict[Cell, list[FailureRow]] = defaultdict(list)
    for row in source.tests.failures:
        reasons[row.cell].append(row)
    return Table(
        key="failures" if source.kind == "displaced" else f"{source.kind}_failures",
        title="Why rollouts failed",
        note="In percent of all trials of a selection. Collided: a move was not free; beside it the two bodies that "
        "met first, in most of these trials. Limits: a move left a joint's position limits, or was faster than its "
        "velocity limit lets it be in one step; beside it the joint. Lost: no rule was broken, and the steps ran out.",
        rows=source.tests.failures,
        headers=(*source.headers, "n", "failed %", "collided %", "mostly", "limits %", "mostly", "lost %"),
        cells=[
            [*source.heads(row), str(row.n), share(reasons[row.cell], row.n),
             *kind_cells(reasons[row.cell], "collided", row.n), *kind_cells(reasons[row.cell], "limits", row.n),
             share(of_kind(reasons[row.cell], "lost"), row.n)]
            for row in source.tests.summaries
        ],
        queries=[source.query("failures", kind=True)],
    )  # fmt: skip


def kind_cells(rows: Sequence[FailureRow], kind: str, n: int) -> list[str]:
    """The share of one kind of failure, and its commonest detail."""
    found = of_kind(rows, kind)
    return [share(found, n), found[0].failure_detail if found else text.NOTHING]


def of_kind(rows: Sequence[FailureRow], kind: str) -> list[FailureRow]:
    """Rows of one kind of failure, in their order."""
    return [row for row in rows if row.failure == kind]


def share(rows: Sequence[FailureRow], n: int) -> str:
    """Failures in percent of n trials."""
    return text.percent(sum(row.failures for row in rows) / n)
