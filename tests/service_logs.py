"""No traceback in any log: what the services of every home that a test makes may have said when the test is over."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

TRACEBACK = "Traceback (most recent call last)"
EXPECTED: list[str] = []  # one list for all folders of tests: each has the fixtures below as its own


def require_none(folder: Path, expected: list[str]) -> None:
    """Fail for every traceback in the logs of homes below a folder, unless it names something expected."""
    logs = [log for levels in ("*", "*/*") for log in sorted(folder.glob(f"{levels}/prefect/*.log"))]
    tracebacks = [
        f"{log}: {TRACEBACK}{text}"
        for log in logs
        for text in log.read_text(errors="replace").split(TRACEBACK)[1:]
        if not any(line in text for line in expected)
    ]
    if tracebacks:
        pytest.fail("\n".join(tracebacks), pytrace=False)


@pytest.fixture(scope="session")
def expected_in_logs() -> list[str]:
    """Parts of the tracebacks that tests with deliberate faults add."""
    return EXPECTED


@pytest.fixture(scope="session", autouse=True)
def no_traceback_in_the_end(
    tmp_path_factory: pytest.TempPathFactory, expected_in_logs: list[str]
) -> Iterator[None]:
    """The first fixture set up is the last torn down: services that other fixtures share have ended by then."""
    yield
    require_none(tmp_path_factory.getbasetemp(), expected_in_logs)


@pytest.fixture(autouse=True)
def no_traceback(tmp_path_factory: pytest.TempPathFactory, expected_in_logs: list[str]) -> Iterator[None]:
    """Homes are made below pytest's temporary folder, by tests and by the fixtures that they share."""
    yield
    require_none(tmp_path_factory.getbasetemp(), expected_in_logs)
