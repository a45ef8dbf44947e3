"""The command that asks the lake."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Mapping
from datetime import date
from decimal import Decimal
from typing import Any, Literal

import pyarrow as pa
import pyarrow.csv
from rich.console import Console
from rich.table import Table

from plancurate.flows.cli.console import console, output, write
from plancurate.flows.cli.options import HomeOptions
from plancurate.tasks.lake.store import Lake

MOST_WIDE = 10_000  # characters


def sql(
    query: str, *, format: Literal["table", "csv", "json"] = "table", options: HomeOptions = HomeOptions()
) -> None:
    """Ask the lake, read-only: views trajectories, ways, selections, evaluations, results, studies, ..."""
    rows = Lake(options.folder().lake).sql(query, say)
    if format == "table":
        show(as_table(rows))
    elif format == "csv":
        pyarrow.csv.write_csv(rows, sys.stdout.buffer)
    else:
        write(json.dumps([as_json(row) for row in rows.to_pylist()], indent=1))


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


def as_json(value: Any) -> Any:
    """Return a value of a query's result as JSON can hold it: times as ISO 8601, what is no number as null."""
    if isinstance(value, Mapping):
        return {str(name): as_json(inner) for name, inner in value.items()}
    if isinstance(value, list):
        return [as_json(inner) for inner in value]
    if isinstance(value, (float, Decimal)):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, date):
        return value.isoformat()
    return value if value is None or isinstance(value, (bool, int)) else str(value)
