"""Part files: written whole or not at all, checked before anything is read from them."""

from __future__ import annotations

import os
import re
import uuid
from collections.abc import Mapping
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from plancurate.errors import PlancurateError
from plancurate.tasks.lake.schema import SCHEMA_VERSION, Table

PART_PATTERN = "part-*.parquet"
# Hidden and without the suffix: neither our globs nor anyone's `*.parquet` can match a half-written file.
TEMPORARY_PATTERN = ".*.tmp"
MERGED_MARK = "~"  # not allowed in keys, so a merged part can't take another part's name
VERSION_FIELD = "plancurate.schema_version"
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


def publish(temporary: Path, path: Path) -> None:
    """Make the finished temporary file appear under its name at once and for good."""
    _sync(temporary)
    temporary.replace(path)
    _sync(path.parent)


def write_part(path: Path, table: Table, rows: pa.Table, metadata: Mapping[str, str]) -> None:
    """Write rows (in the table's file schema) as one part; readers see all of it or nothing."""
    path.parent.mkdir(parents=True, exist_ok=True)
    footer = {f"plancurate.{name}": value for name, value in metadata.items()}
    footer[VERSION_FIELD] = str(SCHEMA_VERSION)
    temporary = temporary_path(path)
    try:
        pq.write_table(
            rows.replace_schema_metadata(footer),
            temporary,
            compression="zstd",
            use_dictionary=[field.name for field in table.schema if field.type == pa.string()],
            column_encoding=dict.fromkeys(_nested_reals(table.schema), "BYTE_STREAM_SPLIT"),
        )
        publish(temporary, path)
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


def read_footer(path: Path, table: Table) -> dict[str, str]:
    """The part's own metadata; PlancurateError that says what is wrong when it is no part of this table."""
    try:
        schema = pq.read_schema(path)
    except (pa.ArrowInvalid, OSError) as error:
        if isinstance(error, FileNotFoundError):
            raise
        reason = str(error).splitlines()[0]
        raise PlancurateError(
            f"{path}: no readable Parquet file ({reason}); remove it and run again"
        ) from None
    footer = {k.decode(): v.decode() for k, v in (schema.metadata or {}).items() if k != b"ARROW:schema"}
    _check_schema(path, table, schema, footer.get(VERSION_FIELD))
    return {k.removeprefix("plancurate."): v for k, v in footer.items() if k.startswith("plancurate.")}


def _check_schema(path: Path, table: Table, schema: pa.Schema, version: str | None) -> None:
    if version is None:
        raise PlancurateError(
            f"{path}: not written by plancurate (no {VERSION_FIELD}); move it out of the lake"
        )
    if version != str(SCHEMA_VERSION):
        raise PlancurateError(
            f"{path}: schema version {version}, but this plancurate reads version {SCHEMA_VERSION}; "
            "use another home folder or the release that wrote it"
        )
    for name in (*table.schema.names, *schema.names):
        if not _same(schema, table.schema, name):
            raise PlancurateError(
                f"{path}: column {name} is {_kind(schema, name)}, the table {table.name} has "
                f"{_kind(table.schema, name)}; move the file out of the lake"
            )


def _same(one: pa.Schema, other: pa.Schema, name: str) -> bool:
    return name in one.names and name in other.names and bool(one.field(name).equals(other.field(name)))


def _kind(schema: pa.Schema, name: str) -> str:
    if name not in schema.names:
        return "missing"
    field = schema.field(name)
    return f"{field.type}{' (may be null)' if field.nullable else ''}"


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
