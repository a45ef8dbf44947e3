"""Whether the parts of a partition are what was written there: nothing is read from one that is not."""

from __future__ import annotations

import fcntl
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from plancurate.errors import PlancurateError
from plancurate.tasks.lake.footer import (
    PARTITION,
    OtherVersionError,
    is_merged,
    merged_parts,
    partition_of,
    read_footer,
    written_as,
)
from plancurate.tasks.lake.manifest import MANIFEST, Entry, Manifest, difference, locked, read_manifest
from plancurate.tasks.lake.schema import PART_PATTERN, Table

Kind = Literal["changed", "missing", "foreign", "misplaced", "other version"]


@dataclass(frozen=True)
class Damage:
    """One file that is not what it should be."""

    path: Path
    kind: Kind
    line: str
    """What is wrong with it and what would be right, path included."""


@dataclass(frozen=True)
class Inventory:
    """What a partition holds."""

    parts: tuple[Path, ...]
    """Sound parts without those merged into another one, which may vanish at any time."""
    damage: tuple[Damage, ...]


class Inspection:
    """Looks at partitions; a part is read through once, and again only when its size or time has changed."""

    def __init__(self) -> None:
        self._sound: set[tuple[Path, int, int]] = (
            set()
        )  # path, size, time of parts that were as they should be

    def settled(self, folder: Path, table: Table) -> Inventory:
        """What the folder holds, seen between two writes where it would look damaged during one."""
        found = self.look(folder, table)
        if found.damage:
            with locked(folder, fcntl.LOCK_SH):
                found = self.look(folder, table)
        return found

    def look(self, folder: Path, table: Table) -> Inventory:
        """What the folder holds at this moment; the caller may hold its lock."""
        files = sorted(folder.glob(PART_PATTERN))  # before the manifest: a part appears after its entry
        manifest = read_manifest(folder)
        damage, sound, held = _unreadable_lines(folder, manifest), [], set()
        for path in sorted(files, key=lambda file: (not is_merged(file), file)):
            if path in held:
                continue
            if problem := self._problem(path, table, manifest.entries.get(path.name)):
                damage.append(problem)
            else:
                sound.append(path)
                held.update(merged_parts(path, table))
        damage += _missing(folder, manifest, {*files, *held})
        return Inventory(
            tuple(path for path in sorted(sound) if path not in held),
            tuple(problem for problem in damage if problem.path not in held),
        )

    def _problem(self, path: Path, table: Table, entry: Entry | None) -> Damage | None:
        if entry is None:
            return _unlisted(path, table)
        status = path.stat()
        mark = (path, status.st_size, status.st_mtime_ns)
        if mark in self._sound:
            return None
        if reason := difference(path, entry):
            return Damage(
                path, "changed", f"{path}: changed since it was written, {reason}; run again what made it"
            )
        fits = entry.written_as == written_as(path.parent, table)
        problem = None if fits else _misfit(path, table)
        if problem is None:
            self._sound.add(mark)
        return problem


def refuse(damage: Iterable[Damage]) -> None:
    """Raise PlancurateError for the first damage, if there is any, and say how many more there are."""
    lines = [problem.line for problem in damage]
    if len(lines) > 1:
        lines[0] += f" ({len(lines) - 1} more: `plancurate doctor --lake` names all)"
    if lines:
        raise PlancurateError(lines[0])


def strays(root: Path, table: Table, partitions: Iterable[Path]) -> list[Damage]:
    """Parquet files below the table's folder that lie in none of its partitions or are no parts."""
    inside = set(partitions)
    return [
        Damage(path, "foreign", f"{path}: foreign, no part of a partition of {table.name}; move it away")
        for path in sorted((root / table.name).rglob("[!.]*.parquet"))
        if path.parent not in inside or not path.match(PART_PATTERN)
    ]


def _unlisted(path: Path, table: Table) -> Damage:
    """What a part is that the manifest does not name: another release's, or somebody's."""
    problem = _misfit(path, table)
    return problem or Damage(path, "foreign", f"{path}: foreign, {MANIFEST} does not name it; move it away")


def _misfit(path: Path, table: Table) -> Damage | None:
    """What keeps a file, whole as it is, from being a part of its partition."""
    try:
        belongs = read_footer(path, table).get(PARTITION, "")
    except OtherVersionError as error:
        return Damage(path, "other version", str(error))
    except PlancurateError as error:
        return Damage(path, "foreign", str(error))
    if belongs == partition_of(path.parent, table):
        return None
    return Damage(
        path, "misplaced", f"{path}: misplaced, its rows belong to {belongs or 'no partition'}; move it there"
    )


def _unreadable_lines(folder: Path, manifest: Manifest) -> list[Damage]:
    path = folder / MANIFEST
    return [
        Damage(path, "changed", f"{path}: changed since it was written, line {line} is no entry")
        for line in manifest.damaged_lines
    ]


def _missing(folder: Path, manifest: Manifest, there: set[Path]) -> list[Damage]:
    return [
        Damage(path, "missing", f"{path}: missing, although {MANIFEST} names it; run again what made it")
        for path in (folder / name for name in manifest.entries)
        if path not in there
    ]
