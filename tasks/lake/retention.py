"""What nobody refers to in a home, found and dropped; what something refers to stays.

Studies that the lake records refer to their pools and labellings, to what they selected and evaluated, and to the
networks that these evaluations, or corrections of these pools, name.
"""

from __future__ import annotations

import shutil
import time
import uuid
from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.locks import read_note
from plancurate.tasks.lake.home import Home
from plancurate.tasks.lake.parts import TEMPORARY_PATTERN
from plancurate.tasks.lake.schema import POOL_LEVELS, TABLES
from plancurate.tasks.lake.status import values
from plancurate.tasks.lake.store import Lake

LEFTOVERS = (TEMPORARY_PATTERN, ".*.damaged")
STUDY, POOL, LABELLING, NETWORK, LEFTOVER = "study", "pool", "labelling", "network", "leftover"
DAY_S = 86400.0


@dataclass(frozen=True)
class Item:
    """A folder or file that stands or falls as a whole."""

    kind: str
    name: str
    """What a person calls it by: a pool's id, a study's identifier, a network's name, a leftover's file name."""
    path: Path
    referred_by: tuple[str, ...]
    """Studies that refer to it."""

    @property
    def bytes(self) -> int:
        """Of all its files."""
        return sum(file.stat().st_size for file in self._files())

    @property
    def changed(self) -> float:
        """Time (s since 1970) of its newest file."""
        return max((file.stat().st_mtime for file in self._files()), default=0.0)

    def _files(self) -> list[Path]:
        return (
            [self.path] if self.path.is_file() else [file for file in self.path.rglob("*") if file.is_file()]
        )


def unreferred(
    home: Home, names: Sequence[str] = (), keep_days: float = 7.0, now: float | None = None
) -> list[Item]:
    """What can go: all that no study refers to and nobody changed for `keep_days`, or only what is named.

    `names` are of studies, pools or networks. What else only the studies named refer to goes with them.
    PlancurateError for a name that is unknown or that a study which is not named refers to.
    """
    found = list(items(home))
    if not names:
        before = (time.time() if now is None else now) - keep_days * DAY_S
        return _outermost(item for item in found if not item.referred_by and item.changed <= before)
    for name in names:
        _require_droppable(name, found, names)
    return _outermost(
        item
        for item in found
        if item.name in names or (item.referred_by and set(item.referred_by) <= set(names))
    )


def _outermost(found: Iterable[Item]) -> list[Item]:
    """Those that do not lie within others of them."""
    chosen = list(found)
    paths = {item.path for item in chosen}
    return [item for item in chosen if not paths & set(item.path.parents)]


def drop(home: Home, chosen: Sequence[Item]) -> None:
    """Remove items, studies first: whatever interrupts it, no study refers to what is gone.

    PlancurateError while a process is at work on a study of the home.
    """
    for path in sorted(home.locks.glob("*.lock")):
        if (note := read_note(path)) is not None:
            raise PlancurateError(
                f"{home.root}: process {note.get('pid', 'unknown')} is at work on study {path.stem}; wait for its end"
            )
    trash = home.root / f".dropped.{uuid.uuid4().hex}.tmp"
    trash.mkdir()
    bucket = Lake(home.lake).bucket
    for number, item in enumerate(sorted(chosen, key=lambda item: item.kind != STUDY)):
        if bucket and item.kind == NETWORK:
            bucket.delete_network(item.path)
        elif bucket and item.kind != LEFTOVER:
            bucket.delete([item.path])
        item.path.rename(trash / str(number))
    shutil.rmtree(trash)


def items(home: Home) -> Iterator[Item]:
    """Everything in the home that may be dropped, with the studies that refer to it.

    PlancurateError where there is no lake, or damage hides what is referred to.
    """
    lake = Lake(home.lake)
    recorded = lake.query("study/pools").to_pylist()
    studies = {row["study"] for row in recorded}
    for study in sorted(studies):
        yield Item(STUDY, study, lake.folder("studies", {"study": study}), (study,))
    for folder in _pool_folders(lake):
        key = values(folder, lake.root)
        own = [row for row in recorded if tuple(row[level] for level in POOL_LEVELS) == key]
        yield Item(POOL, key[-1], folder, _studies(own))
        yield from _within(folder, own)
    yield from _networks(home, lake)
    for path in _leftovers(home):
        yield Item(LEFTOVER, path.name, path, ())


def _require_droppable(name: str, found: Sequence[Item], names: Collection[str]) -> None:
    own = [item for item in found if item.name == name]
    if not own:
        raise UnknownNameError("study, pool or network", name, {item.name for item in found})
    if holders := sorted({study for item in own for study in item.referred_by} - set(names)):
        raise PlancurateError(
            f"{own[0].kind} {name}: {', '.join(holders)} refer{'s' if len(holders) == 1 else ''} to it; "
            "name what refers to it too, or leave it"
        )


def _pool_folders(lake: Lake) -> list[Path]:
    """Of every table that has pools."""
    tables = [kind for kind in TABLES.values() if "pool" in kind.partition]
    above = len(lake.root.parts) + 1 + len(POOL_LEVELS)
    return [
        path
        for kind in tables
        for path in sorted({Path(*folder.parts[:above]) for folder in lake.partitions(kind.name, {})})
    ]


def _within(pool: Path, recorded: Sequence[Mapping[str, str]]) -> Iterator[Item]:
    """What a pool holds of single studies and labellings, with the studies that are recorded with the pool."""
    for kind in (STUDY, LABELLING):
        for folder in sorted(pool.glob(f"{kind}=*")):
            name = folder.name.partition("=")[2]
            yield Item(kind, name, folder, _studies(row for row in recorded if row[kind] == name))


def _studies(rows: Iterable[Mapping[str, str]]) -> tuple[str, ...]:
    return tuple(sorted({row["study"] for row in rows}))


def _networks(home: Home, lake: Lake) -> Iterator[Item]:
    by_network = defaultdict(list)
    for row in lake.query("study/networks").to_pylist():
        by_network[row["network_id"]].append(row)
    for folder in sorted(path for path in home.models.glob("[!.]*") if path.is_dir()):
        yield Item(NETWORK, folder.name, folder, _studies(by_network[folder.name]))


def _leftovers(home: Home) -> list[Path]:
    """Temporary files of killed processes, and parts put aside as damaged."""
    below = [path for pattern in LEFTOVERS for path in home.lake.rglob(pattern)]
    return sorted([*below, *home.root.glob(TEMPORARY_PATTERN), *home.models.glob(".*")])
