"""What a part says of itself in its Parquet footer: schema, version, partition, keys."""

from __future__ import annotations

import hashlib
import json
from functools import cache
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from plancurate.errors import PlancurateError
from plancurate.tasks.lake.schema import SCHEMA_VERSION, TABLES, Table

MERGED_MARK = "~"  # not allowed in keys, so a merged part can't take another part's name
OWN = "plancurate."
VERSION, PARTITION, KEYS, SUPERSEDES = "schema_version", "partition", "keys", "supersedes"


class OtherVersionError(PlancurateError):
    """A part that another release wrote."""


def read_footer(path: Path, table: Table) -> dict[str, str]:
    """The part's own metadata; PlancurateError that says what is wrong when it is no part of this table."""
    try:
        found = pq.read_metadata(path)
        schema = found.schema
    except FileNotFoundError:
        raise
    except (pa.ArrowException, OSError) as error:
        raise PlancurateError(
            f"{path}: no readable Parquet file ({str(error).splitlines()[0]}); move it away and run again"
        ) from None
    footer = {
        name.decode(errors="replace"): value.decode(errors="replace")
        for name, value in (found.metadata or {}).items()
    }
    _check_version(path, footer.get(OWN + VERSION))
    if not schema.equals(_parquet_schema(table.name)):
        _say_difference(path, table, schema.to_arrow_schema())
    return {name.removeprefix(OWN): value for name, value in footer.items() if name.startswith(OWN)}


def partition_of(folder: Path, table: Table) -> str:
    """The partition that a folder is, as its path ends and as its parts' footers say: robot=r/scene=s/..."""
    return "/".join(folder.parts[-len(table.partition) :])


def written_as(folder: Path, table: Table) -> str:
    """What the manifest says of a part written here: table, partition, schema version and columns.

    Where a part is whole and says the same as its folder, its footer need not be read to know that it fits.
    """
    return f"{table.name}/{partition_of(folder, table)} schema {SCHEMA_VERSION}-{_columns_digest(table.name)}"


def part_keys(path: Path, table: Table) -> list[str]:
    """The part's key, or for a merged part those of all parts in it."""
    key = path.name.removeprefix("part-").removesuffix(".parquet")
    return _listed(path, table, KEYS) if is_merged(path) else [key]


def merged_parts(path: Path, table: Table) -> list[Path]:
    """The parts that this part holds; none unless it is a merged one."""
    return [path.with_name(name) for name in _listed(path, table, SUPERSEDES)] if is_merged(path) else []


def is_merged(path: Path) -> bool:
    """Whether the part was made from other parts."""
    return MERGED_MARK in path.name


def _listed(path: Path, table: Table, field: str) -> list[str]:
    try:
        return list(json.loads(read_footer(path, table)[field]))
    except FileNotFoundError:  # merged into another part, which lists the same and more
        return []
    except (KeyError, ValueError):
        raise PlancurateError(f"{path}: its footer lists no {field}; move it away and run again") from None


def _check_version(path: Path, version: str | None) -> None:
    if version is None:
        raise PlancurateError(f"{path}: foreign, not written by plancurate (no {OWN}{VERSION}); move it away")
    if version != str(SCHEMA_VERSION):
        raise OtherVersionError(
            f"{path}: schema version {version}, but this plancurate reads version {SCHEMA_VERSION}; "
            "use another home folder or the release that wrote it"
        )


@cache
def _columns_digest(name: str) -> str:
    return hashlib.sha256(TABLES[name].schema.to_string().encode()).hexdigest()[:8]


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
