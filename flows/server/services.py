"""Services of a home: processes on 127.0.0.1 that end with whoever uses them."""

from __future__ import annotations

import contextlib
import http.client
import os
import signal
import socket
import subprocess
import sys
import time
import urllib.parse
from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path

from plancurate.errors import PlancurateError

HOST = "127.0.0.1"
STOP_TIMEOUT_S = 30.0
FAREWELL = "Application startup failed. Exiting."  # uvicorn's, after the reason

started: list[subprocess.Popen[bytes]] = []  # kept: a server may outlive the run that started it


def spawn(
    module: Sequence[str],
    log: Path,
    environment: Mapping[str, str],
    lifetime: Sequence[str],
    descriptors: Sequence[int] = (),
) -> subprocess.Popen[bytes]:
    """Start a Python module with its arguments as a service in a process group of its own.

    `lifetime` is the watchdog's options that say how long it lives; its output is added to `log`. It inherits
    the open file `descriptors`.
    """
    watched = [sys.executable, "-m", "plancurate.flows.server.watchdog", *lifetime, "--", *module]
    with log.open("ab") as output:
        output.write(f"{datetime.now():%Y-%m-%d %H:%M:%S} {module[0]} starts\n".encode())
        output.flush()
        process = subprocess.Popen(
            watched,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            env=dict(environment),
            start_new_session=True,
            pass_fds=descriptors,
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


def listen(wanted: int) -> socket.socket:
    """A socket that listens on the wanted port where nobody does, otherwise on any free one."""
    for port in (wanted, 0):
        with contextlib.suppress(OSError):
            return socket.create_server((HOST, port))
    raise PlancurateError(f"{HOST}: no free port")


def free_port(wanted: int) -> int:
    """The wanted port when nobody listens there, otherwise any free one."""
    with listen(wanted) as listener:
        return int(listener.getsockname()[1])


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
    return next((line.strip() for line in reversed(lines) if line.strip() and FAREWELL not in line), "none")
