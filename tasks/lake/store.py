"""The lake as a folder: write parts, list their keys, read tables, run queries."""

from __future__ import annotations

import glob
import json
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import duckdb
import pyarrow as pa

from plancurate.errors import PlancurateError
from plancurate.sql import load
from plancurate.tasks.lake.catalog import define_views
from plancurate.tasks.lake.parts import (
    MERGED_MARK,
    PART_PATTERN,
    TEMPORARY_PATTERN,
    conform,
    part_path,
    read_footer,
    safe_name,
    write_part,
)
from plancurate.tasks.lake.schema import TABLES, Table, table

# Every table holds one part without rows under this partition value, so that a view over an empty table
# has its columns. '_' can't begin a partition value of anybody's.
_NOBODY = "_"
_STALE_AFTER_S = 3600.0  # no write takes an hour: an older temporary file belongs to a killed process
_READ_ATTEMPTS = 5


class Lake:
    """Tables of Parquet parts under one folder, safe for any number of readers and writers at once."""

    def __init__(self, root: Path) -> None:
        self.root = root.absolute()
        self._checked: set[tuple[Path, int, int]] = set()  # parts already found sound: path, size, mtime

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
        """Run sql/<name>.sql over the views with bound parameters."""
        return self._run(load(name), parameters)

    def sql(self, statement: str) -> pa.Table:
        """Run one SELECT of the user's: nothing is written, no file outside the lake is opened.

        PlancurateError for anything but a single SELECT (DESCRIBE, SUMMARIZE and SHOW count as such).
        """
        with self.connect(locked=True) as connection:
            try:
                _require_select(connection, statement)
                return connection.sql(statement).to_arrow_table()
            except duckdb.Error as error:
                raise PlancurateError(f"SQL: {str(error).splitlines()[0]}") from None

    def connect(self, *, locked: bool = False) -> duckdb.DuckDBPyConnection:
        """An in-memory DuckDB connection with all views, every part checked; the caller closes it.

        `locked` shuts out every file outside the lake and freezes the settings.
        """
        if not self.root.is_dir():
            raise PlancurateError(f"no lake at {self.root}: generate one first or name another home folder")
        self._lay_out()
        self.check()
        connection = duckdb.connect(config={"temp_directory": str(self.root / ".spill")})
        connection.execute("SET TimeZone = 'UTC'")
        define_views(connection, self.root)
        if locked:
            folder = f"{self.root.resolve()}/"
            connection.execute("SET allowed_directories = [$1, $2]", [folder, glob.escape(folder)])
            connection.execute("SET enable_external_access = false")
            connection.execute("SET lock_configuration = true")
        return connection

    def check(self) -> None:
        """PlancurateError for the first part that is torn, foreign or of another schema version."""
        new = [(path, kind) for kind in TABLES.values() for path in self._parts(kind)]
        with ThreadPoolExecutor(4) as pool:
            list(pool.map(lambda item: self._check_part(*item), new))

    def sweep(self, older_than_s: float = _STALE_AFTER_S) -> list[Path]:
        """Remove temporary files that killed processes left behind; returns their paths."""
        before = time.time() - older_than_s
        stale = [path for path in self.root.rglob(TEMPORARY_PATTERN) if _modified(path) <= before]
        for path in stale:
            path.unlink(missing_ok=True)
        return stale

    def _run(self, statement: str, parameters: Mapping[str, object]) -> pa.Table:
        for attempt in range(_READ_ATTEMPTS):
            try:
                with self.connect() as connection:
                    return connection.sql(statement, params=dict(parameters) or None).to_arrow_table()
            except (
                duckdb.IOException,
                FileNotFoundError,
            ):  # a part was merged between listing and opening it
                if attempt == _READ_ATTEMPTS - 1:
                    raise
        raise AssertionError("unreachable")

    def _parts(self, kind: Table) -> Iterator[Path]:
        levels = "/".join(f"{level}=*" for level in kind.partition)
        yield from (self.root / kind.name).glob(f"{levels}/{PART_PATTERN}")

    def _check_part(self, path: Path, kind: Table) -> None:
        try:
            stat = path.stat()
            mark = (path, stat.st_size, stat.st_mtime_ns)
            if mark not in self._checked:
                read_footer(path, kind)
                self._checked.add(mark)
        except FileNotFoundError:
            return  # merged into another part since it was listed

    def _lay_out(self) -> None:
        """Give every table its part without rows."""
        for kind in TABLES.values():
            path = self._join(kind, [_NOBODY] * len(kind.partition)) / "part-schema.parquet"
            if not path.exists():
                write_part(path, kind, kind.schema.empty_table(), {"key": "schema"})

    def _join(self, kind: Table, values: list[str]) -> Path:
        levels = [f"{level}={value}" for level, value in zip(kind.partition, values, strict=True)]
        return self.root.joinpath(kind.name, *levels)


def part_keys(path: Path, kind: Table) -> list[str]:
    """The part's key, or for a merged part those of all parts in it; none if it has just been removed."""
    key = path.name.removeprefix("part-").removesuffix(".parquet")
    if MERGED_MARK not in key:
        return [key]
    try:
        return list(json.loads(read_footer(path, kind)["keys"]))
    except FileNotFoundError:
        return []


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
