"""Locked files that say who uses a home, or who serves it: the kernel drops a lock however its process ends."""

from __future__ import annotations

import fcntl
import json
import os
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from plancurate.errors import PlancurateError

if TYPE_CHECKING:
    from plancurate.tasks.lake.home import Home

STOP_TIMEOUT_S = 30.0


@contextmanager
def users_lock(home: Home) -> Iterator[IO[str]]:
    """A shared lock that says "I use this home's server"; a server that is just ending is waited for."""
    with (home.prefect / "users.lock").open("a") as file:
        lock(file, fcntl.LOCK_SH, STOP_TIMEOUT_S)
        yield file


def lock(file: IO[str], kind: int, timeout: float) -> None:
    """Lock a file; PlancurateError when somebody else keeps it for longer than `timeout` seconds."""
    deadline = time.monotonic() + timeout
    while not try_lock(file, kind):
        if time.monotonic() > deadline:
            raise PlancurateError(
                f"{file.name}: locked for {timeout:.0f} s; another run on this home hangs, end it first"
            )
        time.sleep(0.05)


def try_lock(file: IO[str], kind: int) -> bool:
    """Lock a file (`fcntl.LOCK_SH` or `LOCK_EX`) unless somebody else's lock stands against it."""
    try:
        fcntl.flock(file, kind | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def write_note(file: IO[str], note: Mapping[str, Any]) -> None:
    """Say in a file that this process has locked who it is and what else the note says."""
    file.truncate(0)
    file.write(json.dumps({"pid": os.getpid(), **note}))
    file.flush()


def read_note(path: Path) -> dict[str, Any] | None:
    """The note of the process that has locked the file; {} before it is written, None where nobody has."""
    with path.open("a+") as file:
        if try_lock(file, fcntl.LOCK_SH):
            return None
        file.seek(0)
        try:
            return dict(json.load(file))
        except json.JSONDecodeError:
            return {}
