"""The lake as a folder: write parts, list their keys, read tables, run queries."""

from __future__ import annotations

import glob
import time
from collections.abc import Mapping
from pathlib import Path

import duckdb
import pyarrow as pa

from plancurate.errors import PlancurateError
from plancurate.sql import load
from plancurate.tasks.lake.catalog import define_views
from plancurate.tasks.lake.parts import (
    TEMPORARY_PATTERN,
    conform,
    merged_parts,
    part_keys,
    part_path,
    read_footer,
    safe_name,
    write_part,
)
from plancurate.tasks.lake.schema import PART_PATTERN, TABLES, Table, table

# Every table holds one part without rows under this partition value, so that a view over an empty table
# has its columns. '_' can't begin a partition value of anybody's.
_NOBODY = "_"
_STALE_AFTER_S = 3600.0  # no write takes an hour: an older temporary file belongs to a killed process
_READ_ATTEMPTS = 5


class Lake:
    """Tables of Parquet parts under one folder, safe for any number of readers and writers at once."""

    def __init__(self, root: Path) -> None:
        self.root = root.resolve()
        self._sound: set[tuple[Path, int, int]] = set()  # parts already checked: path, size, mtime

    def folder(self, name: str, partition: Mapping[str, str]) -> Path:
        """The folder of a partition, all of whose levels must be given; ValueError otherwise."""
        kind = table(name)
        if set(partition) != set(kind.partition):
            raise ValueError(f"{name} is partitioned by {list(kind.partition)}, got {sorted(partition)}")
        return self._join(kind, [safe_name(level, partition[level]) for level in kind.partition])

    def write(
        self, name: str, partition: Mapping[str, str], key: str, rows: pa.Table, metadata: Mapping[str, str]
    ) -> Path:
        """Add the part `key` unless it is there; `metadata` (config hash, seed, versions) goes in its footer.

        `rows` has the columns of the table's schema in any order; partition columns may be among them.
        """
        path = part_path(self.folder(name, partition), key)
        if key not in self.keys(name, partition):
            self._lay_out()
            write_part(path, table(name), conform(table(name), rows), {**metadata, "key": key})
        return path

    def keys(self, name: str, partition: Mapping[str, str]) -> set[str]:
        """Keys of the parts that exist, those merged into a bigger part included."""
        found: set[str] = set()
        for path in self.folder(name, partition).glob(PART_PATTERN):
            found.update(part_keys(path, table(name)))
        return found

    def locate(self, name: str, levels: Mapping[str, str], key: str) -> dict[str, str] | None:
        """Return the first partition matching these levels that has the part `key`, None without one."""
        kind = table(name)
        chosen = [f"{level}={glob.escape(levels.get(level, '')) or '*'}" for level in kind.partition]
        for path in sorted((self.root / name).glob("/".join([*chosen, part_path(Path(), key).name]))):
            return dict(part.split("=", 1) for part in path.parent.relative_to(self.root / name).parts)
        return None

    def read(self, name: str, partition: Mapping[str, str]) -> pa.Table:
        """All rows of the partitions that match any subset of levels; the partition's columns come first."""
        kind = table(name)
        if unknown := set(partition) - set(kind.partition):
            raise ValueError(f"{name} is partitioned by {list(kind.partition)}, not by {sorted(unknown)}")
        where = " AND ".join(f"{level} = ${level}" for level in partition) or "true"
        order = ", ".join((*kind.partition, *kind.identity))
        rows = self._run(f"SELECT * FROM {name} WHERE {where} ORDER BY {order}", dict(partition))
        return rows.select(kind.full_schema.names).cast(kind.full_schema)

    def query(self, name: str, **parameters: object) -> pa.Table:
        """Run sql/<name>.sql over the views with bound parameters; the same parts give the same bits."""
        return self._run(load(name), parameters, threads=1)  # several add floats in the order they finish

    def sql(self, statement: str) -> pa.Table:
        """Run one SELECT of the user's: nothing is written, no file outside the lake is opened.

        PlancurateError for anything but a single SELECT (DESCRIBE, SUMMARIZE and SHOW count as such).
        """
        try:
            return self._run(statement, {}, locked=True)
        except duckdb.Error as error:
            raise PlancurateError(f"SQL: {str(error).splitlines()[0]}") from None

    def connect(self, *, locked: bool = False) -> duckdb.DuckDBPyConnection:
        """An in-memory DuckDB connection with all views over the parts of now; the caller closes it.

        Every part is checked. `locked` shuts out every file outside the lake and freezes the settings.
        """
        if not self.root.is_dir():
            raise PlancurateError(f"no lake at {self.root}: generate one first or name another home folder")
        self._lay_out()
        parts = self.check()
        connection = duckdb.connect(config={"temp_directory": str(self.root / ".spill")})
        connection.execute("SET TimeZone = 'UTC'")
        define_views(connection, parts)
        if locked:
            folder = f"{self.root}/"
            connection.execute("SET allowed_directories = [$1, $2]", [folder, glob.escape(folder)])
            connection.execute("SET enable_external_access = false")
            connection.execute("SET lock_configuration = true")
        return connection

    def check(self) -> dict[str, list[Path]]:
        """Parts of each table without those merged into another one, which may vanish at any time.

        PlancurateError for a part that is torn, foreign or of another schema version.
        """
        return {name: self._sound_parts(kind) for name, kind in TABLES.items()}

    def sweep(self, older_than_s: float = _STALE_AFTER_S) -> list[Path]:
        """Remove temporary files that killed processes left behind; returns their paths."""
        before = time.time() - older_than_s
        stale = [path for path in self.root.rglob(TEMPORARY_PATTERN) if _modified(path) <= before]
        for path in stale:
            path.unlink(missing_ok=True)
        return stale

    def _run(
        self,
        statement: str,
        parameters: Mapping[str, object],
        *,
        locked: bool = False,
        threads: int | None = None,
    ) -> pa.Table:
        for attempts_left in reversed(range(_READ_ATTEMPTS)):
            try:
                with self.connect(locked=locked) as connection:
                    if threads:
                        connection.execute(f"SET threads = {threads:d}")
                    if locked:
                        _require_select(connection, statement)
                    return connection.sql(statement, params=dict(parameters) or None).to_arrow_table()
            except (duckdb.IOException, FileNotFoundError):  # a listed part was merged before it was opened
                if not attempts_left:
                    raise
        raise AssertionError("unreachable")

    def _sound_parts(self, kind: Table) -> list[Path]:
        found = sorted((self.root / kind.name).glob(kind.pattern))
        inside = {part for path in found for part in merged_parts(path, kind)}
        parts = [path for path in found if path not in inside]
        for path in parts:
            self._check_part(path, kind)
        return parts

    def _check_part(self, path: Path, kind: Table) -> None:
        stat = path.stat()
        mark = (path, stat.st_size, stat.st_mtime_ns)
        if mark not in self._sound:
            read_footer(path, kind)
            self._sound.add(mark)

    def _lay_out(self) -> None:
        """Give every table its part without rows."""
        for kind in TABLES.values():
            path = self._join(kind, [_NOBODY] * len(kind.partition)) / "part-schema.parquet"
            if not path.exists():
                write_part(path, kind, kind.schema.empty_table(), {"key": "schema"})

    def _join(self, kind: Table, values: list[str]) -> Path:
        levels = [f"{level}={value}" for level, value in zip(kind.partition, values, strict=True)]
        return self.root.joinpath(kind.name, *levels)


def _require_select(connection: duckdb.DuckDBPyConnection, statement: str) -> None:
    found = connection.extract_statements(statement)
    if len(found) != 1 or found[0].type not in (duckdb.StatementType.SELECT, duckdb.StatementType.MULTI):
        raise PlancurateError("SQL: exactly one SELECT statement is allowed here")
    # DuckDB also runs COPY and INSERT as common table expressions of a SELECT, but not below its top level.
    inner = statement.strip().rstrip(";")
    connection.execute(f"EXPLAIN SELECT * FROM (\n{inner}\n)")


def _modified(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except FileNotFoundError:
        return float("inf")
