"""Real runs of the command line: real Prefect, MLflow, DuckDB and PyBullet in a home folder of their own."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import pytest
from filelock import FileLock

from ..homes import environment, folder_of_run
from ..service_logs import expected_in_logs, no_traceback, no_traceback_in_the_end
from .commands import TIMEOUT_S, Commands, command_line

__all__ = ["expected_in_logs", "no_traceback", "no_traceback_in_the_end"]

Command = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="session")
def commands(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Commands]:
    """Commands of plancurate as a user would type them."""
    with closing(Commands(tmp_path_factory.mktemp("commands"))) as commands:
        yield commands


@pytest.fixture(scope="session")
def plancurate(commands: Commands) -> Command:
    """Run plancurate as a user would and capture what it says."""
    return commands.run


@pytest.fixture(scope="session")
def plancurate_on_shared_server(plancurate: Command, shared_server: str) -> Command:
    """Run plancurate with a configured Prefect server instead of one of its home's own, which takes seconds."""
    return partial(plancurate, PREFECT_API_URL=shared_server)


@dataclass(frozen=True)
class Studied:
    """A finished smoke study: a home to go on in, which tests/integration/test_study.py does, and a copy to read."""

    home: Path
    untouched: Path
    stdout: str
    stderr: str


@pytest.fixture(scope="session")
def smoke(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> Studied:
    """Run the smoke study once a run of the suite for all tests that look at what it leaves."""
    note = folder_of_run(tmp_path_factory, worker_id) / "smoke.json"
    with FileLock(f"{note}.lock"):
        if not note.exists():
            note.write_text(json.dumps(run_smoke(tmp_path_factory.mktemp("smoke"))))
    found = json.loads(note.read_text())
    return Studied(Path(found["home"]), Path(found["untouched"]), found["stdout"], found["stderr"])


def run_smoke(folder: Path) -> dict[str, str]:
    """Run the smoke study in a home without anything and copy that home; returns the fields of a Studied."""
    home, untouched = folder / "home", folder / "untouched"
    done = subprocess.run(
        command_line("study", "--preset", "smoke", "--home", str(home)),
        capture_output=True,
        text=True,
        env=environment(),
        timeout=TIMEOUT_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    shutil.copytree(home, untouched)
    return {
        "home": str(home),
        "untouched": str(untouched),
        "stdout": done.stdout,
        "stderr": done.stderr,
    }
