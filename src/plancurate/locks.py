"""Locked files that say who is at work: the kernel drops a lock however its process ends, `kill -9` included."""

from __future__ import annotations

import fcntl
import json
import os
import time
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

from plancurate.errors import PlancurateError


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
