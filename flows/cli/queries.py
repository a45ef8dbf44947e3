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
from plancurate.flows.cli.tables import as_json, as_markdown
from plancurate.tasks.lake import Lake
from plancurate.tasks.report import build_report, write_report
from plancurate.tasks.study.results import result_rows

MOST_WIDE = 10_000  # characters


def report(
    *, study: str, format: Literal["markdown", "json"] = "markdown", options: HomeOptions = HomeOptions()
) -> None:
    """Print a study's result rows, one for each selector, budget, policy and seed, and write its report."""
    home = options.folder()
    lake = Lake(home.lake)
    rows = result_rows(lake, study)
    page = write_report(build_report(lake, study), home.reports / study)
    write(as_json(rows) if format == "json" else as_markdown([row.report() for row in rows]))
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
