"""A run whose Prefect server dies ends at once: Prefect's client would ask a server that is gone for minutes."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from plancurate.flows.cli.console import complain
from plancurate.flows.cli.stopping import leave
from plancurate.flows.server.own_server import serving
from plancurate.flows.server.services import last_line
from plancurate.tasks.lake.home import Home

POLL_S = 0.5
EXIT_CODE = 1  # incomplete: the same command goes on


@contextmanager
def ends_with_server(home: Home, url: str) -> Iterator[None]:
    """While this lasts, end this process with one line should the home's own server at `url` end.

    It ends as `kill -9` would end it, which the lake is made for: its threads can't be stopped in Prefect's retries.
    A server that was configured is not watched.
    """
    # Beside a configured server a home may have no folder for one of its own.
    server = serving(home) if (home.prefect / "server.lock").exists() else None
    if server is None or server[1] != url:
        yield
        return
    over = threading.Event()
    watch = threading.Thread(target=_watch, args=(home, server[0], over), daemon=True)
    watch.start()
    try:
        yield
    finally:
        over.set()
        watch.join()


def _watch(home: Home, server: int, over: threading.Event) -> None:
    while not over.wait(POLL_S):
        if (serving(home) or (0, ""))[0] != server:
            _end(home)


def _end(home: Home) -> None:
    log = home.prefect / "server.log"
    complain(
        f"{log}: the Prefect server of this run ended, its last words: {last_line(log)}; what was finished is kept, "
        "and the same command goes on from here"
    )
    leave(EXIT_CODE)
