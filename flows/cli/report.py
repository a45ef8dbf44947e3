"""The command that prints and writes a study's report."""

from __future__ import annotations

from typing import Literal

from plancurate.flows.cli.console import console, write
from plancurate.flows.cli.options import HomeOptions
from plancurate.flows.cli.pools import say_degenerate, say_unsteady
from plancurate.flows.cli.tables import as_json, report_markdown
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study.results import study_results
from plancurate.tasks.study.studies import find_study
from plancurate.tasks.study.trial_results import Kind


def report(
    *,
    study: str,
    key: str | None = None,
    kind: Kind | None = None,
    format: Literal["markdown", "json"] = "markdown",
    options: HomeOptions = HomeOptions(),
) -> None:
    """Print the result rows of a study, one for each trained network, and write its report.

    Args:
        study: Name of the study; the one that ran last under it.
        key: Key of an earlier study of that name, the part of its identifier after the name.
        kind: Test targets of the printed rows; every kind that the study has where none is named.
        format: How to print the rows.
    """
    from plancurate.tasks.report import (  # Jinja2 and the figures: no --help needs them
        build_report,
        study_pictures,
        write_report,
    )

    home = options.folder()
    lake = Lake(home.lake)
    results = study_results(lake, find_study(lake, study, key))
    wanted = [results.on(kind)] if kind else results.tests.values()
    rows = [row for tests in wanted for row in tests.networks]
    shown = build_report(results, study_pictures(home, results))
    page = write_report(shown, home.reports / results.study.study)
    write(as_json(rows) if format == "json" else report_markdown(rows))
    say_degenerate(lake, results.study.study)
    say_unsteady(lake, results.study.study)
    console.print(f"report {page}", highlight=False, soft_wrap=True)
