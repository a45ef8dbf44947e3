"""Commands that answer questions from the lake."""

from __future__ import annotations

import sys
from typing import Literal

import pyarrow as pa
import pyarrow.csv
from rich.console import Console
from rich.table import Table

from plancurate.flows.cli.console import console, output
from plancurate.flows.cli.options import HomeOptions
from plancurate.flows.cli.tables import as_json, report_markdown
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.report import build_report, write_report
from plancurate.tasks.study.results import study_results
from plancurate.tasks.study.studies import find_study
from plancurate.tasks.study.trial_results import Kind

MOST_WIDE = 10_000  # characters


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
        kind: Test targets of the printed rows; unseen where the study has some, else displaced.
        format: How to print the rows.
    """
    home = options.folder()
    lake = Lake(home.lake)
    results = study_results(lake, find_study(lake, study, key))
    rows = results.on(kind).networks if kind else results.headline.networks
    page = write_report(build_report(results), home.reports / results.study.study)
    write(as_json(rows) if format == "json" else report_markdown(rows))
    console.print(f"report {page}", highlight=False, soft_wrap=True)


def sql(
    query: str, *, format: Literal["table", "csv", "json"] = "table", options: HomeOptions = HomeOptions()
) -> None:
    """Ask the lake: read-only, with the views trajectories, targets, selections, evaluations, studies, waypoints."""
    rows = Lake(options.folder().lake).sql(query, say)
    if format == "table":
        show(as_table(rows))
    elif format == "csv":
        pyarrow.csv.write_csv(rows, sys.stdout.buffer)
    else:
        write(rows.to_pandas().to_json(orient="records", date_format="iso", indent=1))


def say(line: str) -> None:
    """Tell a person one thing, on a line of its own whatever its width."""
    console.print(line, style="yellow", highlight=False, markup=False, soft_wrap=True)


def show(table: Table) -> None:
    """Print a table; into a file or a pipe as wide as it is, since nothing there limits the width."""
    if output.is_terminal:
        output.print(table)
    else:
        wide = Console(width=MOST_WIDE)
        Console(width=wide.measure(table).maximum, highlight=False).print(table)


def as_table(rows: pa.Table) -> Table:
    """Query result as a table for the terminal."""
    shown = Table(box=None, pad_edge=False, header_style="bold")
    for field in rows.schema:
        number = pa.types.is_integer(field.type) or pa.types.is_floating(field.type)
        shown.add_column(field.name, justify="right" if number else "left", overflow="fold")
    for row in rows.to_pylist():
        shown.add_row(*("" if value is None else text(value) for value in row.values()))
    return shown


def text(value: object) -> str:
    """Value for the terminal; real numbers to six digits."""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def write(answer: str) -> None:
    """Write to standard output as it is, for programs: no wrapping, no colours."""
    sys.stdout.write(answer if answer.endswith("\n") else answer + "\n")
