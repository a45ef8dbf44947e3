"""Merge the small parts of a partition into one, with readers and writers at work.

The merged part appears at once beside the parts it holds and names them in its footer; readers leave those
out (`Lake`) or keep one row of each identity (catalog), so that nothing is seen twice. They are removed only
when the merged part has been there for a while: whoever lists the folder during a removal lists the merged
part too, so that nothing is missed.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Mapping
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from plancurate.tasks.lake.footer import MERGED_MARK, merged_parts, part_keys
from plancurate.tasks.lake.inspection import refuse
from plancurate.tasks.lake.manifest import forget, locked
from plancurate.tasks.lake.parts import write_part
from plancurate.tasks.lake.schema import PART_PATTERN, Table, table
from plancurate.tasks.lake.store import Lake

GRACE_S = 600.0  # far longer than any listing of a folder takes


def compact(
    lake: Lake,
    name: str,
    partition: Mapping[str, str],
    metadata: Mapping[str, str],
    *,
    grace_s: float = GRACE_S,
) -> int:
    """Remove parts merged `grace_s` ago or earlier, merge what is left; returns how many were removed.

    Called twice with the grace time between, it leaves a single part. Running it at any time, from several
    processes, or killing it changes no query's result. PlancurateError for a damaged part.
    """
    kind, folder = table(name), lake.folder(name, partition)
    try:
        refuse(lake.inspection.settled(folder, kind).damage)
        removed = _remove_merged(lake, folder, kind, time.time() - grace_s)
        parts = sorted(folder.glob(PART_PATTERN))
        if len(set(parts) - _inside(parts, kind)) > 1:
            _merge(lake, folder, parts, kind, metadata)
    except FileNotFoundError:  # another process compacts the same partition and has got further
        return 0
    return removed


def _merge(lake: Lake, folder: Path, parts: list[Path], kind: Table, metadata: Mapping[str, str]) -> None:
    names = [part.name for part in parts]
    keys = sorted({key for part in parts for key in part_keys(part, kind)})
    digest = hashlib.sha256("\n".join(names).encode()).hexdigest()[:16]
    footer = {**metadata, "supersedes": json.dumps(names), "keys": json.dumps(keys)}
    path = folder / f"part-merged{MERGED_MARK}{digest}.parquet"
    write_part(path, kind, _rows(parts, kind), footer, lake.bucket)


def _rows(parts: list[Path], kind: Table) -> pa.Table:
    """Rows of all parts in order of identity, each once."""
    rows = pa.concat_tables(
        pq.read_table(part, partitioning=None, page_checksum_verification=True).replace_schema_metadata()
        for part in parts
    )
    by_identity = rows.select(kind.identity).append_column("row", pa.array(range(rows.num_rows)))
    first = by_identity.group_by(list(kind.identity)).aggregate([("row", "min")])
    return rows.take(first.sort_by([(name, "ascending") for name in kind.identity])["row_min"])


def _remove_merged(lake: Lake, folder: Path, kind: Table, before: float) -> int:
    """Remove parts that a merged part, there since before that time, holds; a held part needs no entry."""
    with locked(folder):
        settled = [part for part in folder.glob(PART_PATTERN) if part.stat().st_mtime <= before]
        inside = _inside(settled, kind)
        if lake.bucket:
            lake.bucket.delete(inside)
        forget(folder, (part.name for part in inside))
        removed = [part for part in inside if part.exists()]
        for part in removed:
            part.unlink()
    return len(removed)


def _inside(parts: list[Path], kind: Table) -> set[Path]:
    """Parts that some of these hold."""
    return {inner for part in parts for inner in merged_parts(part, kind)}
