"""Part files: written whole or not at all, checked before anything is read from them."""

from __future__ import annotations

import json
import os
import re
import uuid
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from plancurate.errors import PlancurateError
from plancurate.tasks.lake.schema import SCHEMA_VERSION, TABLES, Table

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
    os.utime(temporary)  # the time of appearing, not that of the first byte: removing merged parts goes by it
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
        found = pq.read_metadata(path)
    except FileNotFoundError:
        raise
    except (pa.ArrowInvalid, OSError) as error:
        raise PlancurateError(
            f"{path}: no readable Parquet file ({str(error).splitlines()[0]}); remove it and run again"
        ) from None
    footer = {name.decode(): value.decode() for name, value in (found.metadata or {}).items()}
    _check_version(path, footer.get(VERSION_FIELD))
    if not found.schema.equals(_parquet_schema(table.name)):
        _say_difference(path, table, found.schema.to_arrow_schema())
    own = "plancurate."
    return {name.removeprefix(own): value for name, value in footer.items() if name.startswith(own)}


def part_keys(path: Path, table: Table) -> list[str]:
    """The part's key, or for a merged part those of all parts in it."""
    key = path.name.removeprefix("part-").removesuffix(".parquet")
    return _listed(path, table, "keys") if is_merged(path) else [key]


def merged_parts(path: Path, table: Table) -> list[Path]:
    """The parts that this part holds; none unless it is a merged one."""
    return [path.with_name(name) for name in _listed(path, table, "supersedes")] if is_merged(path) else []


def is_merged(path: Path) -> bool:
    """Whether the part was made from other parts."""
    return MERGED_MARK in path.name


def _listed(path: Path, table: Table, field: str) -> list[str]:
    try:
        return list(json.loads(read_footer(path, table)[field]))
    except FileNotFoundError:  # merged into another part, which lists the same and more
        return []


def _check_version(path: Path, version: str | None) -> None:
    if version is None:
        raise PlancurateError(f"{path}: not written by plancurate (no {VERSION_FIELD}); move it away")
    if version != str(SCHEMA_VERSION):
        raise PlancurateError(
            f"{path}: schema version {version}, but this plancurate reads version {SCHEMA_VERSION}; "
            "use another home folder or the release that wrote it"
        )


@cache
def _parquet_schema(name: str) -> pq.ParquetSchema:
    """A table's schema as Parquet has it: comparing this is four times faster than Arrow's reading of it."""
    buffer = pa.BufferOutputStream()
    pq.write_table(TABLES[name].schema.empty_table(), buffer)
    return pq.read_metadata(pa.BufferReader(buffer.getvalue())).schema


def _say_difference(path: Path, table: Table, schema: pa.Schema) -> None:
    for name in (*table.schema.names, *schema.names):
        if not _same(schema, table.schema, name):
            raise PlancurateError(
                f"{path}: column {name} is {_kind(schema, name)}, the table {table.name} has "
                f"{_kind(table.schema, name)}; move the file out of the lake"
            )
    raise PlancurateError(f"{path}: its columns are in another order than those of the table {table.name}")


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
