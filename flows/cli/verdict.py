"""What a study says when it is over."""

from __future__ import annotations

from plancurate.flows.cli.console import output
from plancurate.flows.cli.tables import matrix, percent
from plancurate.tasks.curation.selectors.selection import label
from plancurate.tasks.study.context import StudyContext
from plancurate.tasks.study.results import result_rows, summary_rows


def show_results(study: StudyContext) -> None:
    """Print the table of success rates, the best three selections and where to look next."""
    rows, summaries = result_rows(study.lake, study.study), summary_rows(study.lake, study.study)
    output.print()
    tests = rows[0].n * len({row.seed for row in rows})
    output.print(matrix(rows, summaries, f"Success in percent, {tests} tests a cell"))
    output.print(
        "\\[95 % interval]; *, **, ***: differs from General with p < 0.05, 0.01, 0.001", style="dim"
    )
    best = ", ".join(
        f"{label(row.selector, row.budget)} {percent(row.success_rate)}" for row in summaries[:3]
    )
    for what, where in (
        ("best", best),
        ("report", f"{study.home.reports / study.study / 'index.html'}"),
        ("lake", 'plancurate sql "SELECT * FROM evaluations LIMIT 5"'),
        ("pages", "make serve (Prefect and MLflow on 127.0.0.1)"),
    ):
        output.print(f"{what:<7} {where}", highlight=False, soft_wrap=True)
