"""What a folder of files must hold: size and SHA-256 of each file, one line of JSON each.

A line is written before its file appears: a kill between the two leaves a missing file, never an unknown one.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import stat
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType

MANIFEST = "manifest.jsonl"
_FIELDS = {"file": str, "bytes": int, "sha256": str}


@dataclass(frozen=True)
class Entry:
    """One file as it was written; parts of the lake also say how many rows they hold and where they belong."""

    file: str
    bytes: int
    sha256: str
    rows: int | None = None
    written_as: str | None = None


@dataclass(frozen=True)
class Manifest:
    """Entries by file name, and the numbers of lines that can't be read."""

    entries: Mapping[str, Entry]
    damaged_lines: tuple[int, ...] = ()


@contextmanager
def locked(folder: Path, kind: int = fcntl.LOCK_EX) -> Iterator[None]:
    """Keep others from changing the folder's manifest; the kernel lets go when this process dies."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, kind)
        yield
    finally:
        os.close(handle)


def entry_of(path: Path, name: str, rows: int | None = None, written_as: str | None = None) -> Entry:
    """Describe the file at `path` under the name that it has or will have."""
    with path.open("rb") as file:
        sha256 = hashlib.file_digest(file, "sha256").hexdigest()
    return Entry(name, path.stat().st_size, sha256, rows, written_as)


def difference(path: Path, entry: Entry) -> str | None:
    """How the file differs from its entry, None for one that is as it was written; reads all of it."""
    status = path.stat()
    if not stat.S_ISREG(status.st_mode):
        return "it is no file"
    if status.st_size != entry.bytes:
        return f"it has {status.st_size} bytes, {MANIFEST} says {entry.bytes}"
    if entry_of(path, entry.file).sha256 != entry.sha256:
        return f"its SHA-256 is not the one in {MANIFEST}"
    return None


def read_manifest(folder: Path) -> Manifest:
    """The folder's manifest, empty where there is none; parsed again only when the file has changed."""
    path = folder / MANIFEST
    try:
        status = path.stat()
    except FileNotFoundError:
        return Manifest({})
    return _parsed(path, status.st_ino, status.st_size, status.st_mtime_ns)


def append(folder: Path, entry: Entry) -> None:
    """Add an entry, for good once this returns; the caller holds the folder's lock."""
    with (folder / MANIFEST).open("a+b") as file:
        _drop_torn_line(file.fileno())
        file.write(_line(entry))
        file.flush()
        os.fsync(file.fileno())


def write_manifest(folder: Path, entries: Iterable[Entry]) -> None:
    """Replace the manifest at once by one of these entries; the caller holds the folder's lock."""
    temporary = folder / f".{MANIFEST}.tmp"
    with temporary.open("wb") as file:
        file.writelines(map(_line, entries))
        file.flush()
        os.fsync(file.fileno())
    temporary.replace(folder / MANIFEST)


def forget(folder: Path, names: Iterable[str]) -> None:
    """Drop the entries of these files and all damaged lines; the caller holds the folder's lock."""
    gone, manifest = set(names), read_manifest(folder)
    if manifest.damaged_lines or gone & manifest.entries.keys():
        write_manifest(folder, (entry for name, entry in manifest.entries.items() if name not in gone))


def list_files(folder: Path, names: Iterable[str]) -> None:
    """Write the manifest of a folder whose files never change, such as a stored policy."""
    write_manifest(folder, [entry_of(folder / name, name) for name in names])


def folder_damage(folder: Path) -> list[str]:
    """One line for each file of such a folder that is missing or changed."""
    manifest, path = read_manifest(folder), folder / MANIFEST
    if not path.is_file():
        return [f"{path}: no such file, so nothing says whether the files beside it are as they were written"]
    lines = [f"{path}: changed, line {line} is no entry" for line in manifest.damaged_lines]
    for name, entry in manifest.entries.items():
        if not (folder / name).exists():
            lines.append(f"{folder / name}: missing, although {MANIFEST} names it")
        elif reason := difference(folder / name, entry):
            lines.append(f"{folder / name}: changed since it was written, {reason}")
    return lines


@lru_cache(maxsize=4096)
def _parsed(path: Path, inode: int, size: int, mtime_ns: int) -> Manifest:
    """Parse whole lines; a last one without its end belongs to a writer that was killed or is at work."""
    entries, damaged = {}, []
    for number, line in enumerate(path.read_bytes().split(b"\n")[:-1], start=1):
        try:
            fields = json.loads(line)
            if not all(isinstance(fields[name], kind) for name, kind in _FIELDS.items()):
                raise TypeError
            entry = Entry(**{name: fields.get(name) for name in Entry.__dataclass_fields__})
        except (ValueError, KeyError, TypeError):
            damaged.append(number)
        else:
            entries[entry.file] = entry
    return Manifest(MappingProxyType(entries), tuple(damaged))


def _line(entry: Entry) -> bytes:
    known = {name: value for name, value in asdict(entry).items() if value is not None}
    return json.dumps(known).encode() + b"\n"


def _drop_torn_line(handle: int) -> None:
    """Cut off a last line that a killed writer left without its end."""
    size = os.fstat(handle).st_size
    if size and os.pread(handle, 1, size - 1) != b"\n":
        content = os.pread(handle, size, 0)
        os.ftruncate(handle, content.rfind(b"\n") + 1)
