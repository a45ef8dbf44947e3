"""Services of a home: processes on 127.0.0.1 that live as long as somebody uses the home."""

from __future__ import annotations

import contextlib
import fcntl
import http.client
import os
import signal
import socket
import subprocess
import sys
import time
import urllib.parse
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from plancurate.errors import PlancurateError
from plancurate.tasks.lake.home import Home

HOST = "127.0.0.1"
STOP_TIMEOUT_S = 30.0

started: list[subprocess.Popen[bytes]] = []  # kept: a server may outlive the run that started it


@contextmanager
def users_lock(home: Home) -> Iterator[IO[str]]:
    """A shared lock that says "I use this home's services"; a server that is just ending is waited for."""
    with (home.prefect / "users.lock").open("a") as file:
        lock(file, fcntl.LOCK_SH, STOP_TIMEOUT_S)
        yield file


def lock(file: IO[str], kind: int, timeout: float) -> None:
    """Lock a file; PlancurateError when somebody else keeps it for longer than `timeout` seconds."""
    deadline = time.monotonic() + timeout
    while True:
        try:
            fcntl.flock(file, kind | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() > deadline:
                raise PlancurateError(
                    f"{file.name}: locked for {timeout:.0f} s; another run on this home hangs, end it first"
                ) from None
            time.sleep(0.05)
        else:
            return


def spawn_guarded(
    home: Home, command: Sequence[str], log: Path, environment: Mapping[str, str], options: Sequence[str] = ()
) -> subprocess.Popen[bytes]:
    """Start a Python module as a service that ends with the home's last user; its output goes to `log`."""
    guard = [
        sys.executable,
        "-m",
        "plancurate.flows.server.watchdog",
        str(home.prefect / "users.lock"),
        *options,
        "--",
    ]
    with log.open("wb") as output:
        process = subprocess.Popen(
            [*guard, *command],
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            env=dict(environment),
            start_new_session=True,
        )
    started.append(process)
    return process


def stop(process: subprocess.Popen[bytes]) -> None:
    """End a service with everything it started: politely, and after a while by force."""
    deadline = time.monotonic() + STOP_TIMEOUT_S
    with contextlib.suppress(ProcessLookupError):  # the group is empty
        os.killpg(process.pid, signal.SIGTERM)
        while time.monotonic() < deadline:
            process.poll()
            os.killpg(process.pid, 0)
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def free_port(wanted: int) -> int:
    """The wanted port when nobody listens there, otherwise any free one."""
    for port in (wanted, 0):
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((HOST, port))
            except OSError:
                continue
            return int(probe.getsockname()[1])
    raise PlancurateError(f"{HOST}: no free port")


def healthy(url: str) -> bool:
    """Whether the service at `url` says so at its path /health; asked directly, past any proxy."""
    where = urllib.parse.urlsplit(url)
    connection = http.client.HTTPConnection(where.hostname or HOST, where.port, timeout=2.0)
    try:
        connection.request("GET", f"{where.path}/health")
        return connection.getresponse().status == http.HTTPStatus.OK
    except (OSError, http.client.HTTPException):
        return False
    finally:
        connection.close()


def last_line(log: Path) -> str:
    """The last thing that a service said, for an error message."""
    lines = log.read_text(errors="replace").split("\n") if log.exists() else []
    return next((line.strip() for line in reversed(lines) if line.strip()), "none")
