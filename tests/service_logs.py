"""No traceback in any log: what the services of every home that a test makes may have said when the test is over."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

TRACEBACK = "Traceback (most recent call last)"
EXPECTED = ["\nasyncio.exceptions.CancelledError\n", " in _persist_worker_channel_heartbeat\n"]
"""Parts of tracebacks that are no fault; one list for all folders of tests, which have the fixtures below as their own.

A server that is told to stop cancels the queries that it is in. And Prefect notes a worker's sign of life in a
transaction that reads before it writes; SQLite refuses it at once ("database is locked") where something else was
written in between. The worker then opens its channel again, and its next sign of life is noted.
"""
BEGINNING = re.compile(
    r"(?<!direct cause of the following exception:\n\n)(?<!another exception occurred:\n\n)"
    + re.escape(TRACEBACK)
)
"""Where a traceback begins that is not the consequence of the one above it: a chain of exceptions is one fault."""
READ: dict[Path, int] = {}
"""Bytes of each log that have been looked at: a traceback is the fault of the test during which it appeared."""


def require_none(folder: Path) -> None:
    """Fail for every new traceback in the logs of homes below a folder, unless it holds something expected."""
    logs = [log for levels in ("*", "*/*") for log in sorted(folder.glob(f"{levels}/prefect/*.log"))]
    tracebacks = [
        f"{log}: {TRACEBACK}{text}"
        for log in logs
        for text in BEGINNING.split(unread(log))[1:]
        if not any(part in f"{text}\n" for part in EXPECTED)
    ]
    if tracebacks:
        pytest.fail("\n".join(tracebacks), pytrace=False)


def unread(log: Path) -> str:
    """What a log has got since the last look at it."""
    with log.open("rb") as file:
        file.seek(READ.get(log, 0))
        content = file.read()
        READ[log] = file.tell()
    return content.decode(errors="replace")


@pytest.fixture(scope="session")
def expected_in_logs() -> list[str]:
    """Parts of the tracebacks that tests with deliberate faults add."""
    return EXPECTED


@pytest.fixture(scope="session", autouse=True)
def no_traceback_in_the_end(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """The first fixture set up is the last torn down: services that other fixtures share have ended by then."""
    yield
    require_none(tmp_path_factory.getbasetemp())


@pytest.fixture(autouse=True)
def no_traceback(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Homes are made below pytest's temporary folder, by tests and by the fixtures that they share."""
    yield
    require_none(tmp_path_factory.getbasetemp())
