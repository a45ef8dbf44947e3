"""DuckDB sessions for our own queries over chosen parts of the lake, which wait for the next query over the same."""

from __future__ import annotations

import atexit
import itertools
import os
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import duckdb

from plancurate.tasks.lake import engine
from plancurate.tasks.lake.catalog import define_views

SPILL = ".spill"
_KEPT = 16
_numbers = itertools.count()
_idle: list[_Session] = []
"""Sessions that nobody uses, the one that was used last at the end."""
_parents: list[_Session] = []
"""Sessions of the process that this one was forked from. They lack its threads: neither used nor closed here."""
_guard = threading.Lock()


@dataclass(frozen=True, eq=False)
class _Session:
    """A connection to an engine that others use too, and the database there that has the views of some parts."""

    connection: duckdb.DuckDBPyConnection
    database: str
    over: object
    """The lake's folder and the parts."""

    def close(self) -> None:
        """Take the database off its engine and close the connection."""
        with self.connection as connection:
            connection.execute("USE memory")
            connection.execute(f"DETACH {self.database}")


@contextmanager
def short_session(root: Path, parts: Mapping[str, Sequence[Path]]) -> Iterator[duckdb.DuckDBPyConnection]:
    """A connection for one of our own queries with the views of these tables over these parts.

    Making views takes longer than most queries. A session can wait for the next query over the same parts because
    the content of a part never changes.
    """
    session = _waiting(root, parts) or _opened(root, parts)
    try:
        yield session.connection
    except BaseException:
        session.close()
        raise
    _keep(session)


@contextmanager
def own_session(root: Path, parts: Mapping[str, Sequence[Path]]) -> Iterator[duckdb.DuckDBPyConnection]:
    """A connection with such views that is the caller's alone and in which tables may be made; it does not wait."""
    session = _opened(root, parts)
    try:
        yield session.connection
    finally:
        session.close()


def _waiting(root: Path, parts: Mapping[str, Sequence[Path]]) -> _Session | None:
    """Take the session over these parts that was used last from those that wait, if there is one."""
    with _guard:
        place = next((place for place, one in enumerate(_idle) if one.over == (root, parts)), None)
        return None if place is None else _idle.pop(place)


def _opened(root: Path, parts: Mapping[str, Sequence[Path]]) -> _Session:
    session = _Session(engine.connect(root / SPILL), f"session_{next(_numbers)}", (root, parts))
    session.connection.execute(f"ATTACH ':memory:' AS {session.database}")
    try:
        session.connection.execute(f"USE {session.database}")
        define_views(session.connection, parts)
    except BaseException:
        session.close()
        raise
    return session


def _keep(session: _Session) -> None:
    """Let a session wait for the next query; of too many, those that have waited longest are closed."""
    with _guard:
        _idle.append(session)
        surplus = _idle[:-_KEPT]
        del _idle[:-_KEPT]
    for one in surplus:
        one.close()


def _leave_to_parent() -> None:
    _parents.extend(_idle)
    _idle.clear()


@atexit.register
def _close_all() -> None:
    while _idle:  # DuckDB's binding complains of connections that are there in the end
        _idle.pop().close()


os.register_at_fork(after_in_child=_leave_to_parent)
