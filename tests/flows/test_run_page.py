"""What the log of a run's page says of a run that failed."""

from __future__ import annotations

import logging

import pytest

import plancurate.flows.run_page  # noqa: F401
from plancurate.errors import PlancurateError

MISTAKE = "shelf.yaml: no such file"


@pytest.fixture
def lines(caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch) -> pytest.LogCaptureFixture:
    """What gets past the filters of the logger of flow runs."""
    logger = logging.getLogger("prefect.flow_runs")
    monkeypatch.setattr(logger, "handlers", [caplog.handler])
    monkeypatch.setattr(logger, "propagate", False)
    return caplog


def log(message: str, error: Exception) -> None:
    logging.getLogger("prefect.flow_runs").error(message, exc_info=error)


def test_a_mistake_is_one_sentence_and_said_once(lines: pytest.LogCaptureFixture) -> None:
    log("Encountered exception during execution", PlancurateError(MISTAKE))
    log("Engine execution exited with unexpected exception", PlancurateError(MISTAKE))
    assert [(record.getMessage(), record.exc_info) for record in lines.records] == [(MISTAKE, None)]


def test_an_error_of_the_program_keeps_its_traceback(lines: pytest.LogCaptureFixture) -> None:
    log("Encountered exception during execution", ValueError("a bug"))
    (record,) = lines.records
    assert record.exc_info is not None
