"""A study whose MLflow server is killed says so in one line and ends; nothing of it is lost."""

from __future__ import annotations

import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path

import pytest

from plancurate.flows.server.services import HOST, free_port, healthy

from ..homes import environment
from .conftest import Command, Studied

PROMISED_S = 30  # docs/reliability.md
START_TIMEOUT_S = 120
TRACKED = "SELECT count(*) FROM tags WHERE key = 'plancurate.evaluation_id'"


@dataclass
class MlflowServer:
    """A real server with a process group of its own."""

    process: subprocess.Popen[bytes]
    url: str
    database: Path
    killed_at: float = 0.0

    def kill_after_tracking(self, networks: int) -> None:
        """Kill -9 the server once it has runs of so many networks."""
        with closing(sqlite3.connect(self.database)) as database:
            while self.tracked(database) < networks:
                time.sleep(0.005)
        os.killpg(self.process.pid, signal.SIGKILL)
        self.killed_at = time.monotonic()

    def tracked(self, database: sqlite3.Connection) -> int:
        """How many networks have a run."""
        with suppress(sqlite3.OperationalError):  # the server writes
            return int(database.execute(TRACKED).fetchone()[0])
        return 0


@pytest.fixture
def mlflow_server(tables: Path, tmp_path: Path) -> Iterator[MlflowServer]:
    """A server that answers."""
    database = Path(shutil.copy(tables / "mlflow.db", tmp_path))
    port = free_port(0)
    words = [
        "--backend-store-uri",
        f"sqlite:///{database}",
        "--default-artifact-root",
        str(tmp_path / "kept"),
    ]
    words += ["--host", HOST, "--port", str(port), "--workers", "1"]
    quiet = environment(MLFLOW_DISABLE_TELEMETRY="true", MLFLOW_SERVER_ENABLE_JOB_EXECUTION="false")
    with subprocess.Popen(
        [sys.executable, "-m", "mlflow", "server", *words],
        env=quiet,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    ) as process:
        server = MlflowServer(process, f"http://{HOST}:{port}", database)
        try:
            deadline = time.monotonic() + START_TIMEOUT_S
            while not healthy(server.url):
                assert time.monotonic() < deadline
                time.sleep(0.1)
            yield server
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)


def test_a_study_whose_mlflow_server_is_killed_ends_with_one_line(
    smoke: Studied, plancurate_on_shared_server: Command, mlflow_server: MlflowServer, tmp_path: Path
) -> None:
    home = shutil.copytree(smoke.untouched, tmp_path / "home")
    killer = threading.Thread(target=mlflow_server.kill_after_tracking, args=(2,), daemon=True)
    killer.start()
    words = ["study", "--preset", "smoke", "--home", str(home)]
    done = plancurate_on_shared_server(*words, MLFLOW_TRACKING_URI=mlflow_server.url)
    assert time.monotonic() - mlflow_server.killed_at < PROMISED_S
    lines = [line for line in done.stderr.splitlines() if line.startswith("plancurate: ")]
    assert done.returncode == 1, done.stderr
    assert len(lines) == 1, done.stderr
    assert f"MLFLOW_TRACKING_URI={mlflow_server.url}: no MLflow server answers there" in lines[0]
    assert "the same command goes on from here" in lines[0]
