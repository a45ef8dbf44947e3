"""DuckDB engines that stay open: a new one registers thousands of functions, which takes longer than most queries."""

from __future__ import annotations

import atexit
import os
from functools import lru_cache
from pathlib import Path
from typing import Any

import duckdb


def connect(spill: Path | None = None) -> duckdb.DuckDBPyConnection:
    """A connection of its own to this process's engine that spills to that folder; the caller closes it.

    The engine works with one thread: several would add numbers in the order in which they end. Tables and views
    that a connection shall not share with others go into a database that it attaches, or are temporary.
    """
    return _engine(os.getpid(), spill).cursor()


@lru_cache(maxsize=4)
def _engine(_pid: int, spill: Path | None) -> duckdb.DuckDBPyConnection:
    """A forked process needs an engine of its own, for it lacks the threads of its parent's."""
    # Nothing of the lake shall stay in memory: the next query reads its files anew.
    settings: dict[str, Any] = {"threads": 1, "enable_external_file_cache": False}
    engine = duckdb.connect(config=settings | ({"temp_directory": str(spill)} if spill else {}))
    engine.execute("SET TimeZone = 'UTC'")
    return engine


atexit.register(_engine.cache_clear)  # or DuckDB's binding complains of what is open in the end
