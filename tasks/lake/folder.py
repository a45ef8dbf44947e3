"""The lake's folders and files: write parts, list their keys, tell which are sound."""

from __future__ import annotations

import glob
from collections.abc import Iterable, Mapping
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from plancurate.errors import PlancurateError
from plancurate.tasks.lake.bucket import bucket_of
from plancurate.tasks.lake.footer import is_merged, part_keys
from plancurate.tasks.lake.inspection import Damage, Inspection, strays
from plancurate.tasks.lake.parts import conform, part_path, safe_name, write_part
from plancurate.tasks.lake.schema import PART_PATTERN, POOL_LEVELS, TABLES, Table, table

# Every table holds one part without rows under this partition value, so that a view over an empty table
# has its columns. '_' can't begin a partition value of anybody's.
_NOBODY = "_"


class LakeFolder:
    """Tables of Parquet parts under one folder, safe for any number of readers and writers at once.

    `levels` are values of partition levels (robot, scene, pool, planner, study), as many as one likes. Whatever
    reads takes only the partitions that match those of the levels that a table has (for a study without a pool:
    of its own pools), and refuses a damaged part among them; damage elsewhere does not matter.
    """

    def __init__(self, root: Path) -> None:
        self.root = root.resolve()
        self.inspection = Inspection()
        self.bucket = bucket_of(self.root)

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
            own = {**metadata, "key": key}
            write_part(path, table(name), conform(table(name), rows), own, self.bucket)
        return path

    def keys(self, name: str, partition: Mapping[str, str]) -> set[str]:
        """Keys of the parts that exist, those merged into a bigger part included."""
        self._pull(table(name), partition)
        paths = self.folder(name, partition).glob(PART_PATTERN)
        return {key for path in paths for key in part_keys(path, table(name))}

    def locate(self, name: str, levels: Mapping[str, str], key: str) -> dict[str, str] | None:
        """The first partition that matches the levels and has a sound part `key`; None if there is none."""
        kind = table(name)
        for folder in self.partitions(name, levels):
            if part_path(folder, key).exists() or any(map(is_merged, folder.glob(PART_PATTERN))):
                parts = self.inspection.settled(folder, kind).parts
                if any(key in part_keys(path, kind) for path in parts):
                    return dict(level.split("=", 1) for level in folder.parts[-len(kind.partition) :])
        return None

    def partitions(self, name: str, levels: Mapping[str, str]) -> list[Path]:
        """Folders of the partitions that match the levels; a level that the table lacks cuts nothing."""
        kind = table(name)
        self._pull(kind, levels)
        return sorted(path for path in self.root.glob(_pattern(kind, levels)) if path.is_dir())

    def _needed(self, name: str, levels: Mapping[str, str]) -> list[Path]:
        """Partitions that a question about these levels reads: of a study's trajectories, those of its pools."""
        if "study" not in levels or "pool" in levels or "study" in table(name).partition:
            return self.partitions(name, levels)
        pools = [dict(zip(POOL_LEVELS, pool, strict=True)) for pool in sorted(self._pools(levels["study"]))]
        return [folder for pool in pools for folder in self.partitions(name, {**pool, **levels})]

    def _pools(self, study: str) -> set[tuple[str, ...]]:
        """The pools that a study is recorded with, by their levels."""
        kind = table("studies")
        parts = [
            path
            for folder in self.partitions("studies", {"study": study})
            for path in self.inspection.settled(folder, kind).parts
        ]
        rows = [row for path in parts for row in pq.ParquetFile(path).read(list(POOL_LEVELS)).to_pylist()]
        return {tuple(row[level] for level in POOL_LEVELS) for row in rows}

    def exists(self) -> bool:
        """Whether anything was ever written; a bucket is asked when it is read."""
        return self.bucket is not None or self.root.is_dir()

    def damage(self) -> list[Damage]:
        """Everything in the lake that is not as it was written, and Parquet files that are no parts of it."""
        if not self.exists():
            return []
        found = self.inventory(TABLES, {})[1]
        for kind in TABLES.values():
            found += strays(self.root, kind, [*self.partitions(kind.name, {}), self._nobody(kind)])
        return found

    def inventory(
        self, names: Iterable[str], levels: Mapping[str, str]
    ) -> tuple[dict[str, list[Path]], list[Damage]]:
        """Sound parts of the tables in the partitions that match, and everything that is wrong there."""
        if not self.exists():
            raise PlancurateError(f"no lake at {self.root}: generate one first or name another home folder")
        self._lay_out()
        parts: dict[str, list[Path]] = {}
        damage: list[Damage] = []
        for kind in map(table, names):
            folders = [*self._needed(kind.name, levels), self._nobody(kind)]
            found = [self.inspection.settled(folder, kind) for folder in folders]
            parts[kind.name] = [path for inventory in found for path in inventory.parts]
            damage += [problem for inventory in found for problem in inventory.damage]
        return parts, damage

    def _lay_out(self) -> None:
        """Give every table its part without rows."""
        for kind in TABLES.values():
            path = self._nobody(kind) / "part-schema.parquet"
            if not path.exists():
                write_part(path, kind, kind.schema.empty_table(), {"key": "schema"}, None)

    def _pull(self, kind: Table, levels: Mapping[str, str]) -> None:
        if self.bucket:
            self.bucket.pull(f"{_pattern(kind, levels)}/{PART_PATTERN}")

    def _nobody(self, kind: Table) -> Path:
        return self._join(kind, [_NOBODY] * len(kind.partition))

    def _join(self, kind: Table, values: list[str]) -> Path:
        levels = [f"{level}={value}" for level, value in zip(kind.partition, values, strict=True)]
        return self.root.joinpath(kind.name, *levels)


def _pattern(kind: Table, levels: Mapping[str, str]) -> str:
    """Pattern of the folders of the partitions that match the levels."""
    chosen = [f"{level}={glob.escape(levels.get(level, '')) or '[!_]*'}" for level in kind.partition]
    return "/".join((kind.name, *chosen))
