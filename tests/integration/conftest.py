"""Real runs of the command line: real Prefect, MLflow, DuckDB and PyBullet in a home folder of their own."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import pytest

from ..homes import environment
from ..service_logs import expected_in_logs, no_traceback, no_traceback_in_the_end

__all__ = ["expected_in_logs", "no_traceback", "no_traceback_in_the_end"]

Command = Callable[..., subprocess.CompletedProcess[str]]


def command_line(*words: str) -> list[str]:
    """Return the plancurate command as this interpreter runs it."""
    return [sys.executable, "-c", "from plancurate.flows.cli.app import main; main()", *words]


@pytest.fixture(scope="session")
def plancurate() -> Command:
    """Run plancurate as a user would and capture what it says."""

    def run(*words: str, **variables: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            command_line(*words),
            capture_output=True,
            text=True,
            env=environment(**variables),
            timeout=600,
            check=False,
        )

    return run


@pytest.fixture(scope="session")
def plancurate_on_shared_server(plancurate: Command, shared_server: str) -> Command:
    """Run plancurate with a configured Prefect server instead of one of its home's own, which takes seconds."""
    return partial(plancurate, PREFECT_API_URL=shared_server)


@dataclass(frozen=True)
class Studied:
    """A finished smoke study."""

    home: Path
    stdout: str
    stderr: str


@pytest.fixture(scope="session")
def smoke(plancurate: Command, tmp_path_factory: pytest.TempPathFactory) -> Studied:
    """Run the smoke study once for all tests that look at what it leaves."""
    home = tmp_path_factory.mktemp("smoke")
    done = plancurate("study", "--preset", "smoke", "--home", str(home))
    assert done.returncode == 0, done.stderr
    return Studied(home, done.stdout, done.stderr)
