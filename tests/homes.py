"""Homes for tests that need services: databases whose tables are made already, and a Prefect server to share.

Making Prefect's and MLflow's tables takes longer than most tests, and a server takes seconds to start, so a run of
the suite makes the tables once, and commands that are about something else share one server.
"""

from __future__ import annotations

import os
import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest
from filelock import FileLock

UNCONFIGURED = ("PREFECT_API_URL", "MLFLOW_TRACKING_URI", "PLANCURATE_HOME", "PLANCURATE_LAKE")
MAKE_TABLES = """
import sys
from plancurate.flows.server.prefect_server import prefect_server
from plancurate.tasks.lake.home import Home
from plancurate.tasks.study.mlflow_store import ensure_store

home = Home.resolve(sys.argv[1])
ensure_store(home.mlflow_db)
with prefect_server(home):
    pass
"""
KEEP_SERVER = """
import sys
from plancurate.flows.server.prefect_server import prefect_server
from plancurate.tasks.lake.home import Home

with prefect_server(Home.resolve(sys.argv[1])) as url:
    print(url, flush=True)
    sys.stdin.read()
"""
DATABASES = ("mlflow.db", "prefect/prefect.db")

NewHome = Callable[[Path], Path]


def environment(**variables: str) -> dict[str, str]:
    """Return this process's environment without what a user may have configured, plus variables."""
    kept = {name: value for name, value in os.environ.items() if name not in UNCONFIGURED}
    return kept | variables


def folder_of_run(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> Path:
    """Return the temporary folder that all workers of a run share."""
    own = tmp_path_factory.getbasetemp()
    return own if worker_id == "master" else own.parent


@pytest.fixture(scope="session")
def tables(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> Path:
    """A folder of DATABASES with tables and without content, which all workers of a run share."""
    folder = folder_of_run(tmp_path_factory, worker_id) / "tables"
    with FileLock(f"{folder}.lock"):
        if not folder.exists():
            home = tmp_path_factory.mktemp("used")
            subprocess.run([sys.executable, "-c", MAKE_TABLES, str(home)], env=environment(), check=True)
            for name in DATABASES:
                copy_database(home / name, home / "closed" / name)
            (home / "closed").rename(folder)
    return folder


def copy_database(source: Path, target: Path) -> None:
    """Copy a SQLite database with what its log file still holds."""
    target.parent.mkdir(parents=True, exist_ok=True)
    with closing(sqlite3.connect(source)) as database, closing(sqlite3.connect(target)) as copy:
        database.backup(copy)


@pytest.fixture(scope="session")
def new_home(tables: Path) -> NewHome:
    """Make a folder, which may exist, a home where services start at once; returns it."""

    def make(folder: Path) -> Path:
        return Path(shutil.copytree(tables, folder, dirs_exist_ok=True))

    return make


@pytest.fixture(scope="session")
def shared_server(new_home: NewHome, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """API URL of a Prefect server that ends with the last test."""
    command = [sys.executable, "-c", KEEP_SERVER, str(new_home(tmp_path_factory.mktemp("server")))]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, env=environment(), stdin=pipe, stdout=pipe, text=True) as process:
        assert process.stdout is not None
        yield process.stdout.readline().strip()
