"""One process at a time works on a study of a home: a second would delete what the first has in hand in MLflow."""

from __future__ import annotations

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager

from plancurate.errors import PlancurateError
from plancurate.locks import read_note, try_lock, write_note
from plancurate.tasks.lake.home import Home


@contextmanager
def exclusive(home: Home, study: str) -> Iterator[None]:
    """Keep every other process off the study of that identifier; PlancurateError where one is at work on it."""
    path = home.locks / f"{study}.lock"
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a+") as file:
        while not try_lock(file, fcntl.LOCK_EX):
            if (note := read_note(path)) is not None:
                raise PlancurateError(
                    f"study {study} in {home.root}: process {note.get('pid', 'unknown')} is at work on it; "
                    "wait for its end, or give this study another name"
                )
        write_note(file, {})
        yield
