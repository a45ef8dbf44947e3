"""What a lake holds, by its manifests: no file is read through, so it is known at once."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from plancurate.errors import PlancurateError
from plancurate.tasks.lake.footer import is_merged, merged_parts
from plancurate.tasks.lake.manifest import read_manifest
from plancurate.tasks.lake.schema import PART_PATTERN, POOL_LEVELS, TABLES, Table
from plancurate.tasks.lake.store import Lake


@dataclass(frozen=True)
class Size:
    """How much a table or a pool holds; parts that a merged one holds too are not counted."""

    parts: int
    rows: int
    bytes: int

    def __add__(self, other: Size) -> Size:
        """Return both together."""
        return Size(self.parts + other.parts, self.rows + other.rows, self.bytes + other.bytes)


NOTHING = Size(0, 0, 0)


@dataclass(frozen=True)
class PoolStatus:
    """One pool."""

    robot: str
    scene: str
    pool: str
    targets: int
    runs: int
    size: Size
    """Of everything below it, selections and evaluations included."""
    studies: tuple[str, ...]
    """Those that refer to it."""


@dataclass(frozen=True)
class LakeStatus:
    """What a lake holds."""

    tables: dict[str, Size]
    pools: tuple[PoolStatus, ...]
    studies: tuple[str, ...]


def lake_status(lake: Lake) -> LakeStatus:
    """Count tables, pools and studies; PlancurateError where there is no lake."""
    if not lake.exists():
        raise PlancurateError(f"no lake at {lake.root}: generate one first or name another home folder")
    sizes = {
        (kind.name, folder): _size(folder, kind)
        for kind in TABLES.values()
        for folder in lake.partitions(kind.name, {})
    }
    tables = {name: _total(size for (own, _), size in sizes.items() if own == name) for name in TABLES}
    recorded = lake.query_sound("study/pools").to_pylist()
    by_pool: dict[tuple[str, ...], dict[str, Size]] = defaultdict(lambda: dict.fromkeys(TABLES, NOTHING))
    for (name, folder), size in sizes.items():
        if "pool" in TABLES[name].partition:
            by_pool[values(folder, lake.root)[: len(POOL_LEVELS)]][name] += size
    pools = (_pool_status(key, own, recorded) for key, own in sorted(by_pool.items()))
    return LakeStatus(tables, tuple(pools), tuple(dict.fromkeys(row["study"] for row in recorded)))


def _pool_status(
    key: tuple[str, ...], tables: Mapping[str, Size], recorded: Sequence[Mapping[str, str]]
) -> PoolStatus:
    using = {row["study"] for row in recorded if tuple(row[level] for level in POOL_LEVELS) == key}
    robot, scene, pool = key
    return PoolStatus(
        robot,
        scene,
        pool,
        targets=tables["targets"].rows,
        runs=tables["trajectories"].rows,
        size=_total(tables.values()),
        studies=tuple(sorted(using)),
    )


def values(folder: Path, root: Path) -> tuple[str, ...]:
    """Values of the partition levels that a folder of the lake lies in, in their order."""
    return tuple(part.partition("=")[2] for part in folder.relative_to(root).parts[1:])


def _size(folder: Path, kind: Table) -> Size:
    known = read_manifest(folder).entries
    files = sorted(folder.glob(PART_PATTERN))
    inside = {inner for path in files if is_merged(path) for inner in merged_parts(path, kind)}
    entries = [known[path.name] for path in files if path not in inside and path.name in known]
    return Size(
        len(entries), sum(entry.rows or 0 for entry in entries), sum(entry.bytes for entry in entries)
    )


def _total(sizes: Iterable[Size]) -> Size:
    return sum(sizes, NOTHING)
