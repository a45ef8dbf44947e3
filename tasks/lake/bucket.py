"""A lake in an S3-compatible bucket: the bucket holds the parts, the lake's folder a copy of those asked for here.

A part never changes, so that a copy of it is as good as the part, and everything else works on files. A part goes into
the bucket before it appears in the folder, in one request that also holds its manifest's entry and that fails where
somebody else's was first. Hence what the folder holds and the bucket does not was removed there, and is removed here.
"""

from __future__ import annotations

import glob
import json
import os
import re
import shutil
import tarfile
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import asdict
from datetime import timedelta
from fnmatch import fnmatchcase
from functools import lru_cache
from itertools import groupby, takewhile
from pathlib import Path
from typing import TYPE_CHECKING

from plancurate.errors import PlancurateError
from plancurate.tasks.lake.manifest import MANIFEST, Entry, difference, entry_of, forget, locked
from plancurate.tasks.lake.parts import enter, temporary_path

if TYPE_CHECKING:
    from obstore.store import ObjectStore, RetryConfig

VARIABLE = "PLANCURATE_LAKE"
MARK = "copy-of"  # a file in the folder that names the bucket: nobody shall go on without it as if nothing were missing
CONNECTIONS = 16
RETRIES: RetryConfig = {"max_retries": 5, "retry_timeout": timedelta(seconds=30)}
_ENTRY = "entry"
_TAG = re.compile(r"<[^>]*>")


class Bucket:
    """The bucket behind a lake's folder, by the paths that its parts have there.

    Every method raises PlancurateError for what the store refuses, or where it does not answer.
    """

    def __init__(self, root: Path, url: str, store: ObjectStore) -> None:
        self._root, self._url, self._store = root, url, store

    def put(self, path: Path, file: Path, entry: Entry) -> bool:
        """Add the file as the part at `path` unless the bucket has that one; returns whether it was added."""
        self._mark()
        return self._put(self._key(path), file, entry)

    def pull(self, pattern: str) -> None:
        """Make the folder's parts that match the pattern those of the bucket."""
        self._mark()
        here = {
            str(path.relative_to(self._root)) for path in self._root.glob(pattern)
        }  # before the bucket is asked
        there = set(self._keys(pattern))
        self.fetch(self._root / key for key in there - here)
        for folder, gone in groupby(
            sorted(self._root / key for key in here - there), lambda path: path.parent
        ):
            _forget(folder, list(gone))

    def fetch(self, paths: Iterable[Path]) -> None:
        """Copy these parts into the folder, those that are still in the bucket."""
        with ThreadPoolExecutor(CONNECTIONS) as threads:
            list(threads.map(self._fetch, paths))

    def delete(self, paths: Iterable[Path]) -> None:
        """Remove these parts, and everything below these folders."""
        keys = [key for path in paths for key in (*self._keys(f"{self._key(path)}/*"), self._key(path))]
        with self._said():
            self._store.delete(keys)

    def put_network(self, folder: Path, content: Path) -> None:
        """Add the network that is to be `folder`, all its files at once, unless the bucket has it."""
        archive = temporary_path(folder)
        try:
            with tarfile.open(archive, "w") as files:
                files.add(content, ".")
            self._put(_network(folder), archive, entry_of(archive, folder.name))
        finally:
            archive.unlink(missing_ok=True)

    def pull_network(self, folder: Path) -> None:
        """Copy a trained network here, where the bucket has it."""
        archive, unpacked = temporary_path(folder), temporary_path(folder)
        folder.parent.mkdir(parents=True, exist_ok=True)
        try:
            if self._get(_network(folder), archive):
                with tarfile.open(archive) as files:
                    files.extractall(unpacked, filter="data")
                with suppress(OSError):  # another process was first
                    unpacked.rename(folder)
        finally:
            archive.unlink(missing_ok=True)
            shutil.rmtree(unpacked, ignore_errors=True)

    def delete_network(self, folder: Path) -> None:
        """Remove a network."""
        with self._said():
            self._store.delete([_network(folder)])

    def _fetch(self, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = temporary_path(path)
        try:
            if entry := self._get(self._key(path), temporary):
                enter(temporary, path, entry)
        finally:
            temporary.unlink(missing_ok=True)

    def _put(self, key: str, file: Path, entry: Entry) -> bool:
        from obstore.exceptions import AlreadyExistsError

        with self._said():
            try:
                said = {_ENTRY: json.dumps(asdict(entry))}
                self._store.put(key, file, mode="create", attributes=said, use_multipart=False)
            except AlreadyExistsError:
                return False
        return True

    def _get(self, key: str, file: Path) -> Entry | None:
        """Write what the bucket has under the key into a file and return its entry; None where it has nothing."""
        with self._said():
            try:
                found = self._store.get(key)
            except FileNotFoundError:
                return None
            entry = Entry(**json.loads(found.attributes[_ENTRY]))
            with file.open("wb") as content:
                content.writelines(found)
        if reason := difference(file, entry):
            raise PlancurateError(
                f"{self._url}/{key}: changed since it was written, {reason.replace(MANIFEST, 'its entry')}; remove it "
                "and run again what made it"
            )
        return entry

    def _keys(self, pattern: str) -> Iterator[str]:
        """Keys that match; only what is below the pattern's first folders without wildcards is listed."""
        levels = pattern.split("/")[:-1]
        exact = "/".join(takewhile(lambda level: not glob.has_magic(level), levels))
        with self._said():
            for found in self._store.list(exact):
                yield from (item["path"] for item in found if fnmatchcase(item["path"], pattern))

    def _key(self, path: Path) -> str:
        return path.relative_to(self._root).as_posix()

    def _mark(self) -> None:
        mark = self._root / MARK
        if not mark.exists():
            self._root.mkdir(parents=True, exist_ok=True)
            temporary = temporary_path(mark)  # nobody shall read half an address
            temporary.write_text(self._url)
            temporary.replace(mark)

    @contextmanager
    def _said(self) -> Iterator[None]:
        from obstore.exceptions import BaseError

        try:
            yield
        except (BaseError, FileNotFoundError) as error:
            said = _TAG.sub(
                " ", str(error).partition("\n\nDebug source:")[0]
            )  # the store's own words are XML
            raise PlancurateError(f"{self._url}: {' '.join(said.split())}") from None


def bucket_of(root: Path) -> Bucket | None:
    """The bucket that a lake's folder is a copy of; None for a folder that is the lake itself.

    PlancurateError where the environment names another one than the folder's, or the folder holds a lake of its own.
    """
    mark = root / MARK
    own = mark.read_text() if mark.exists() else None
    url = (os.environ.get(VARIABLE) or own or "").rstrip("/")
    if not url:
        return None
    if not url.startswith("s3://"):
        raise PlancurateError(f"{VARIABLE}={url}: s3://BUCKET or s3://BUCKET/PREFIX would be right")
    if own not in (None, url):
        raise PlancurateError(
            f"{VARIABLE}={url}: {root} is a copy of {own}; another home folder would be right"
        )
    if own is None and any(root.glob("*/[!.]*=[!_]*")):
        raise PlancurateError(
            f"{VARIABLE}={url}: {root} holds a lake of its own; another home folder would be right"
        )
    return Bucket(root, url, _store(url))


@lru_cache(maxsize=4)
def _store(url: str) -> ObjectStore:
    try:
        from obstore.store import S3Store
    except ImportError:
        raise PlancurateError(f"{VARIABLE}={url}: obstore is missing; pip install 'plancurate[s3]'") from None
    # A server without TLS is used only where AWS_ENDPOINT_URL says http://.
    return S3Store.from_url(url, client_options={"allow_http": True}, retry_config=RETRIES)


def _network(folder: Path) -> str:
    return f"models/{folder.name}.tar"


def _forget(folder: Path, paths: list[Path]) -> None:
    with locked(folder):
        forget(folder, (path.name for path in paths))
        for path in paths:
            path.unlink(missing_ok=True)
