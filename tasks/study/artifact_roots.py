"""Where MLflow's database says that files lie: in the home it belongs to, also after the home was copied or moved."""

from __future__ import annotations

import re
import sqlite3
from contextlib import closing
from pathlib import Path

# Columns of MLflow's tables that hold the location of files as a URI.
_COLUMNS = (
    ("experiments", "artifact_location"),
    ("runs", "artifact_uri"),
    ("logged_models", "artifact_location"),
    ("model_versions", "source"),
    ("model_versions", "storage_location"),
)
_ROOT = re.compile(r"(file:///.*/artifacts)(/\d+)?")  # MLflow's server adds the experiment's number


def adopt_artifacts(database: Path, artifacts: Path, made_by: str) -> int:
    """Point what lies in another home's `artifacts` to this folder; returns how many roots were replaced.

    Only experiments with the tag `made_by` say what another home's folder is; all happens in one transaction.
    """
    root = artifacts.absolute().as_uri()
    with closing(sqlite3.connect(database, timeout=60)) as connection, connection:
        others = {other for other in _roots(connection, made_by) if other != root}
        for other in others:
            for table, column in _COLUMNS:
                connection.execute(
                    f"UPDATE {table} SET {column} = :root || substr({column}, length(:other) + 1) "
                    f"WHERE {column} = :other OR substr({column}, 1, length(:other) + 1) = :other || '/'",
                    {"root": root, "other": other},
                )
    return len(others)


def _roots(connection: sqlite3.Connection, made_by: str) -> set[str]:
    rows = connection.execute(
        "SELECT DISTINCT artifact_location FROM experiments JOIN experiment_tags USING (experiment_id) "
        "WHERE experiment_tags.key = ?",
        [made_by],
    )
    return {found[1] for (location,) in rows if (found := _ROOT.fullmatch(location))}
