"""What counts as a fault in a service's log."""

from __future__ import annotations

from pathlib import Path

import pytest

from .service_logs import require_none

CAUSE = (
    "Traceback (most recent call last):\n  line 1, in execute\nsqlite3.OperationalError: database is locked\n"
)
FOLLOWS = "\nThe above exception was the direct cause of the following exception:\n\n"
FAULT = "Traceback (most recent call last):\n  line 2, in {}\nOperationalError: database is locked\n"


def log_with(folder: Path, text: str) -> Path:
    """A folder with a home whose server said that, deeper than where logs are looked for after each test."""
    log = folder / "deeper" / "home" / "prefect" / "server.log"
    log.parent.mkdir(parents=True)
    log.write_text(text)
    return folder / "deeper"


def test_a_heartbeat_that_sqlite_refused_is_no_fault_with_its_cause(tmp_path: Path) -> None:
    require_none(log_with(tmp_path, CAUSE + FOLLOWS + FAULT.format("_persist_worker_channel_heartbeat")))


@pytest.mark.parametrize("text", [CAUSE, CAUSE + FOLLOWS + FAULT.format("create_flow_run")])
def test_every_other_refusal_is_one(tmp_path: Path, text: str) -> None:
    with pytest.raises(pytest.fail.Exception) as failure:
        require_none(log_with(tmp_path, text))
    assert str(failure.value).count("server.log:") == 1


@pytest.mark.slow
def test_a_fault_after_an_expected_one_is_found(tmp_path: Path) -> None:
    expected = CAUSE + FOLLOWS + FAULT.format("_persist_worker_channel_heartbeat")
    with pytest.raises(pytest.fail.Exception, match="create_flow_run"):
        require_none(log_with(tmp_path, expected + "12:00 | INFO\n" + FAULT.format("create_flow_run")))
