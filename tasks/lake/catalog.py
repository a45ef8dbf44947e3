"""The lake's views and macros: in memory for ourselves, as lake/catalog.duckdb for everyone else."""

from __future__ import annotations

import glob
import hashlib
from pathlib import Path

import duckdb

from plancurate.sql import load, names
from plancurate.tasks.lake.parts import publish, temporary_path

CATALOG_NAME = "catalog.duckdb"
# DuckDB 1.4 and the tools built on it still open this; 2.0's own default they can't.
_STORAGE_VERSION = "v1.2.0"
_FIRST = "views/macros"
_LAST = "views/waypoints"  # reads another view


def define_views(connection: duckdb.DuckDBPyConnection, root: Path) -> None:
    """Create lake_root(), the metric macros and all views in the connection's current database."""
    for statement in _definitions(root):
        connection.execute(statement)


def write_catalog(root: Path) -> Path:
    """Write root/catalog.duckdb unless it already says the same; it opens from any working folder."""
    path = root / CATALOG_NAME
    digest = hashlib.sha256("".join(_definitions(root)).encode()).hexdigest()
    if _digest_of(path) == digest:
        return path
    temporary = temporary_path(path)
    try:
        with duckdb.connect() as connection:
            connection.execute(
                f"ATTACH {_quoted(str(temporary))} AS built (STORAGE_VERSION '{_STORAGE_VERSION}')"
            )
            connection.execute("USE built")
            define_views(connection, root)
            connection.execute(f"CREATE MACRO catalog_digest() AS {_quoted(digest)}")
            connection.execute("USE memory")
            connection.execute("DETACH built")
        publish(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
    return path


def _definitions(root: Path) -> list[str]:
    # A view can't take bound parameters; this macro is the one place where a path enters SQL text.
    folder = _quoted(glob.escape(str(root.resolve())))
    views = [name for name in names("views") if name not in (_FIRST, _LAST)]
    return [f"CREATE OR REPLACE MACRO lake_root() AS {folder}", *map(load, (_FIRST, *views, _LAST))]


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
