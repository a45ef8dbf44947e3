"""The lake's views and macros: in memory for ourselves, as lake/catalog.duckdb for everyone else."""

from __future__ import annotations

import glob
import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import duckdb

from plancurate.sql import load
from plancurate.tasks.lake.parts import publish, temporary_path
from plancurate.tasks.lake.schema import TABLES

CATALOG_NAME = "catalog.duckdb"
# DuckDB 1.4 and the tools built on it still open this; 2.0's own default they can't.
_STORAGE_VERSION = "v1.2.0"
# In this order: the last ones read views before them.
_QUERIES = (
    "views/macros",
    *(f"views/{name}" for name in TABLES),
    "views/waypoints",
    "views/study_candidates",
    "views/study_trials",
    "views/scene_trials",
)


def define_views(connection: duckdb.DuckDBPyConnection, parts: Mapping[str, Sequence[Path]]) -> None:
    """Create the metric macros and all views over these parts of each table, in memory.

    Every look then sees the same parts, however many come and go meanwhile.
    """
    for name, paths in parts.items():
        connection.execute(f"SET VARIABLE {name}_parts = $1", [[glob.escape(str(path)) for path in paths]])
        connection.execute(f"CREATE MACRO {name}_parts() AS getvariable('{name}_parts')")
    for query in _QUERIES:
        connection.execute(load(query))


def write_catalog(root: Path) -> Path:
    """Write root/catalog.duckdb unless it already says the same; it opens from any working folder."""
    path = root / CATALOG_NAME
    statements = _catalog_statements(root)
    digest = hashlib.sha256("".join(statements).encode()).hexdigest()
    if _digest_of(path) == digest:
        return path
    temporary = temporary_path(path)
    try:
        with duckdb.connect() as connection:
            connection.execute(
                f"ATTACH {_quoted(str(temporary))} AS built (STORAGE_VERSION '{_STORAGE_VERSION}')"
            )
            connection.execute("USE built")
            for statement in (*statements, f"CREATE MACRO catalog_digest() AS {_quoted(digest)}"):
                connection.execute(statement)
            connection.execute("USE memory")
            connection.execute("DETACH built")
        publish(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
    return path


def _catalog_statements(root: Path) -> list[str]:
    # A view can't take bound parameters; these macros are the one place where a path enters SQL text.
    folder = glob.escape(str(root.resolve()))
    places = [
        f"CREATE MACRO {kind.name}_parts() AS {_quoted(f'{folder}/{kind.name}/{kind.pattern}')}"
        for kind in TABLES.values()
    ]
    return [*places, *map(load, _QUERIES)]


def _digest_of(path: Path) -> str | None:
    """What the catalog was built from, or None when there is no (readable) catalog."""
    if not path.exists():
        return None
    try:
        with duckdb.connect(str(path), read_only=True) as connection:
            row = connection.execute("SELECT catalog_digest()").fetchone()
    except duckdb.Error:
        return None
    return str(row[0]) if row else None


def _quoted(text: str) -> str:
    return "'" + text.replace("'", "''") + "'"
