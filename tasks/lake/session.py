"""DuckDB sessions of one's own over chosen parts of the lake, and what a statement may do there."""

from __future__ import annotations

import glob
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import duckdb

from plancurate.errors import PlancurateError
from plancurate.tasks.lake.catalog import DERIVED_VIEWS, define_views
from plancurate.tasks.lake.schema import TABLES
from plancurate.tasks.lake.short_session import SPILL


def open_session(
    root: Path, parts: Mapping[str, Sequence[Path]], *, locked: bool = False
) -> duckdb.DuckDBPyConnection:
    """An in-memory connection with the views of these tables over these parts; the caller closes it.

    `locked` shuts out every file outside the lake and freezes the settings.
    """
    connection = duckdb.connect(config={"temp_directory": str(root / SPILL)})
    connection.execute("SET TimeZone = 'UTC'")
    define_views(connection, parts)
    if locked:
        folder = f"{root}/"
        connection.execute("SET allowed_directories = [$1, $2]", [folder, glob.escape(folder)])
        connection.execute("SET enable_external_access = false")
        connection.execute("SET lock_configuration = true")
    return connection


def tables_named_in(statement: str) -> list[str]:
    """Tables that a statement can read: those whose names it holds, or all where it holds none (SHOW TABLES).

    A word too many, as in a comment, costs a look at a table; views of the other tables are not made.
    """
    words = set(re.findall(r"\w+", statement.lower()))
    for name, tables in DERIVED_VIEWS.items():
        if name in words:
            words |= tables
    return [name for name in TABLES if name in words] or list(TABLES)


def require_select(connection: duckdb.DuckDBPyConnection, statement: str) -> None:
    """Raise PlancurateError or duckdb.Error unless the statement is a single SELECT that writes nothing."""
    found = connection.extract_statements(statement)
    if len(found) != 1 or found[0].type not in (duckdb.StatementType.SELECT, duckdb.StatementType.MULTI):
        raise PlancurateError("SQL: exactly one SELECT statement is allowed here")
    # DuckDB also runs COPY and INSERT as common table expressions of a SELECT, but not below its top level.
    inner = statement.strip().rstrip(";")
    connection.execute(f"EXPLAIN SELECT * FROM (\n{inner}\n)")
