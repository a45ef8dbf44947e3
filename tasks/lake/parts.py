"""Part files: written whole or not at all, and entered in the folder's manifest before they appear."""

from __future__ import annotations

import os
import re
import shutil
import time
import uuid
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import pyarrow as pa
import pyarrow.parquet as pq

from plancurate.errors import PlancurateError
from plancurate.tasks.lake.footer import OWN, PARTITION, VERSION, partition_of, written_as
from plancurate.tasks.lake.manifest import Entry, append, entry_of, locked
from plancurate.tasks.lake.schema import SCHEMA_VERSION, Table

if TYPE_CHECKING:
    from plancurate.tasks.lake.bucket import Bucket

# Hidden and without the suffix: neither our globs nor anyone's `*.parquet` can match a half-written file.
TEMPORARY_PATTERN = ".*.tmp"
STALE_AFTER_S = 3600.0  # no write takes an hour: an older temporary file belongs to a killed process
_SAFE = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.+-]*")


def part_path(folder: Path, key: str) -> Path:
    """Where the part of that key lies; PlancurateError for a key unfit as a file name."""
    return folder / f"part-{safe_name('key', key)}.parquet"


def safe_name(what: str, value: str) -> str:
    """The value itself when it can be a folder or file name everywhere; PlancurateError otherwise."""
    if not _SAFE.fullmatch(value):
        raise PlancurateError(
            f"{what} {value!r} is no name for a folder: use letters, digits, _ . + - and begin with "
            "a letter or digit"
        )
    return value


def temporary_path(path: Path) -> Path:
    """A new name beside `path` that no reader looks at."""
    return path.with_name(f".{path.name}.{uuid.uuid4().hex}.tmp")


def sweep(folder: Path, older_than_s: float = STALE_AFTER_S) -> list[Path]:
    """Remove temporary files and folders that killed processes left below a folder; returns their paths."""
    before = time.time() - older_than_s
    stale = [path for path in folder.rglob(TEMPORARY_PATTERN) if _modified(path) <= before]
    for path in stale:
        shutil.rmtree(path, ignore_errors=True) if path.is_dir() else path.unlink(missing_ok=True)
    return stale


def _modified(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except FileNotFoundError:
        return float("inf")


def publish(temporary: Path, path: Path) -> None:
    """Make the finished temporary file appear under its name at once and for good."""
    _sync(temporary)
    os.utime(temporary)  # the time of appearing, not that of the first byte: removing merged parts goes by it
    temporary.replace(path)
    _sync(path.parent)


def enter(temporary: Path, path: Path, entry: Entry) -> None:
    """Make a finished part appear at `path`, after its entry in the manifest, unless there is one."""
    with locked(path.parent):
        if not path.exists():
            append(path.parent, entry)
            publish(temporary, path)


def write_part(
    path: Path, table: Table, rows: pa.Table, metadata: Mapping[str, str], bucket: Bucket | None
) -> None:
    """Write rows (in the table's file schema) as one part; readers see all of it or nothing.

    Of several writers of the same part at once the first one's stays, in the bucket where the lake has one.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    footer = {OWN + name: value for name, value in metadata.items()}
    footer[OWN + VERSION] = str(SCHEMA_VERSION)
    footer[OWN + PARTITION] = partition_of(path.parent, table)
    temporary = temporary_path(path)
    try:
        pq.write_table(
            rows.replace_schema_metadata(footer),
            temporary,
            compression="zstd",
            use_dictionary=[field.name for field in table.schema if field.type == pa.string()],
            column_encoding=dict.fromkeys(_nested_reals(table.schema), "BYTE_STREAM_SPLIT"),
            write_page_checksum=True,
        )
        _sync(temporary)  # the slow part, before others have to wait
        entry = entry_of(temporary, path.name, rows.num_rows, written_as(path.parent, table))
        if bucket is None or bucket.put(path, temporary, entry):
            enter(temporary, path, entry)
        else:
            bucket.fetch([path])
    except OSError as error:
        error.filename = error.filename or str(
            path
        )  # pyarrow names no file, and who makes room needs to know where
        raise
    finally:
        temporary.unlink(missing_ok=True)


def conform(table: Table, rows: pa.Table) -> pa.Table:
    """Rows in the table's file schema, partition columns dropped; ValueError if a column is off."""
    rows = rows.drop_columns([name for name in table.partition if name in rows.column_names])
    if sorted(rows.column_names) != sorted(table.schema.names):
        missing = sorted(set(table.schema.names) - set(rows.column_names))
        extra = sorted(set(rows.column_names) - set(table.schema.names))
        raise ValueError(f"rows for {table.name}: missing columns {missing}, unknown columns {extra}")
    for field in table.schema:
        if not field.nullable and rows[field.name].null_count:
            raise ValueError(f"rows for {table.name}: column {field.name} must not hold nulls")
    return rows.select(table.schema.names).cast(table.schema)


def _nested_reals(schema: pa.Schema) -> list[str]:
    """Parquet's names of the numbers inside list<list<...>> columns."""
    return [f"{field.name}.list.element.list.element" for field in schema if pa.types.is_list(field.type)]


def _sync(path: Path) -> None:
    """Have the disk hold the file's or folder's content before anything that follows."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
