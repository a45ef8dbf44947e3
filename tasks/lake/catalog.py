"""The lake's views and macros: in memory for ourselves, as lake/catalog.duckdb for everyone else."""

from __future__ import annotations

import glob
import hashlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import duckdb

from plancurate.sql import load
from plancurate.tasks.lake.comments import COLUMNS, comment, quoted
from plancurate.tasks.lake.parts import publish, temporary_path
from plancurate.tasks.lake.schema import TABLES

CATALOG_NAME = "catalog.duckdb"
# DuckDB 1.4 and the tools built on it still open this; 2.0's own default they can't.
_STORAGE_VERSION = "v1.2.0"
DERIVED_VIEWS = {
    "waypoints": {"trajectories"},
    "study_candidates": {"trajectories", "studies", "ways"},
    "study_trials": {"evaluations", "studies"},
    "final_trials": {"evaluations", "studies"},
    "scene_trials": {"evaluations", "studies"},
    "results": {"evaluations", "studies"},
    "only_selection": {"selections"},
    "selection_diff": {"selections"},
}
"""Views and macros over the tables' own views, with the tables that they read; later ones read earlier ones."""


def define_views(connection: duckdb.DuckDBPyConnection, parts: Mapping[str, Sequence[Path]]) -> None:
    """Create the metric macros and the views of these tables over these parts, in memory.

    Every look then sees the same parts, however many come and go meanwhile.
    """
    connection.execute("CREATE MACRO is_beside_catalog() AS true")
    for name, paths in parts.items():
        connection.execute(f"SET VARIABLE {name}_parts = $1", [[glob.escape(str(path)) for path in paths]])
        connection.execute(f"CREATE MACRO {name}_parts() AS getvariable('{name}_parts')")
    for statement in _views(parts):
        connection.execute(statement)


def write_catalog(root: Path) -> Path:
    """Write root/catalog.duckdb unless it already says the same; it reads the lake that it lies in, even copied."""
    path = root / CATALOG_NAME
    statements = list(_catalog_statements())
    digest = hashlib.sha256("".join((*statements, *COLUMNS.values())).encode()).hexdigest()
    if _digest_of(path) == digest:
        return path
    temporary = temporary_path(path)
    try:
        with duckdb.connect() as connection:
            connection.execute(
                "SET VARIABLE lake_folder = $1", [str(root.resolve())]
            )  # views are tried at once
            connection.execute(
                f"ATTACH {quoted(str(temporary))} AS built (STORAGE_VERSION '{_STORAGE_VERSION}')"
            )
            connection.execute("USE built")
            for statement in (*statements, f"CREATE MACRO catalog_digest() AS {quoted(digest)}"):
                connection.execute(statement)
            comment(connection)
            connection.execute("USE memory")
            connection.execute("DETACH built")
        publish(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
    return path


def _catalog_statements() -> Iterator[str]:
    yield load("views/beside")
    for kind in TABLES.values():
        pattern = quoted(f"{kind.name}/{kind.pattern}")
        yield f"CREATE MACRO {kind.name}_parts() AS lake_files({pattern})"
    yield from _views(TABLES)


def _views(names: Mapping[str, object]) -> Iterator[str]:
    yield load("views/macros")
    yield load("views/statistics")
    for name in names:
        yield load(f"views/{name}")
    for name, tables in DERIVED_VIEWS.items():
        if names.keys() >= tables:
            yield load(f"views/{name}")


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
