"""The Prefect server of a home: joined where it runs, started where it does not, ended by its last user."""

from __future__ import annotations

import fcntl
import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import IO, TYPE_CHECKING, Any

from plancurate.errors import PlancurateError
from plancurate.flows.server.services import (
    HOST,
    STOP_TIMEOUT_S,
    healthy,
    last_line,
    listen,
    spawn,
    started,
)
from plancurate.locks import lock, read_note, try_lock
from plancurate.tasks.lake.home import Home

if TYPE_CHECKING:
    from prefect.client.schemas.objects import State

START_TIMEOUT_S = 120.0
DATABASE = "PREFECT_API_DATABASE_CONNECTION_URL"

SERVER_DEFAULTS = {
    # One row a message keeps up with about 20 task runs a second; in batches with any thread runner.
    "PREFECT_SERVER_SERVICES_TASK_RUN_RECORDER_BATCH_SIZE": "200",
    "PREFECT_SERVER_SERVICES_TASK_RUN_RECORDER_READ_BATCH_SIZE": "200",
    "PREFECT_SERVER_SERVICES_TASK_RUN_RECORDER_FLUSH_INTERVAL": "1",
    # Nobody watches a run's own server for events, and storing them costs a third of the throughput.
    "PREFECT_SERVER_SERVICES_EVENT_PERSISTER_ENABLED": "false",
    "PREFECT_SERVER_SERVICES_TRIGGERS_ENABLED": "false",
    "PREFECT_SERVER_ANALYTICS_ENABLED": "false",
    "PREFECT_UI_SHOW_PROMOTIONAL_CONTENT": "false",
    "PREFECT_SERVER_LOGGING_LEVEL": "WARNING",
    "PREFECT_LOGGING_LEVEL": "WARNING",
}


@contextmanager
def own_server(home: Home, port: int, meanwhile: Callable[[], object]) -> Iterator[str]:
    """API URL of the home's server while it is used; the arguments are those of `prefect_server`."""
    home.prefect.mkdir(parents=True, exist_ok=True)
    with (home.prefect / "users.lock").open("a") as users:
        lock(users, fcntl.LOCK_SH, STOP_TIMEOUT_S)  # a server that is just ending is waited for
        try:
            yield _join_or_start(home, port, meanwhile)
        finally:
            _leave(home, users)


def serving(home: Home) -> tuple[int, str] | None:
    """Process id and API URL of the home's server; the URL is empty until it is known, None says there is none."""
    note = read_note(home.prefect / "server.lock")
    return None if note is None else (note.get("pid", 0), note.get("url", ""))


def _join_or_start(home: Home, port: int, meanwhile: Callable[[], object]) -> str:
    """API URL of the home's server, once it answers."""
    with (home.prefect / "start.lock").open("a") as start:
        lock(start, fcntl.LOCK_EX, START_TIMEOUT_S)
        process = None if serving(home) else _spawn_server(home, port)
        meanwhile()
        deadline = time.monotonic() + START_TIMEOUT_S
        while time.monotonic() < deadline:
            _, url = serving(home) or (0, "")
            if url and healthy(url):
                # Servers of other homes may use a configured database, and their runs are at work.
                if process is not None and DATABASE not in os.environ:
                    _crash_dead_runs(url)
                return url
            if process is not None and process.poll() is not None:
                break
            time.sleep(0.05)
    log = home.prefect / "server.log"
    raise PlancurateError(f"{log}: the Prefect server did not start; its last words: {last_line(log)}")


def _crash_dead_runs(url: str) -> None:
    """Say of runs that an earlier server left as running that they are not: they ended with their processes.

    Left as they are, they would occupy the slots of their deployments for good.
    """
    from prefect.client.orchestration import SyncPrefectClient
    from prefect.client.schemas.filters import FlowRunFilter, TaskRunFilter
    from prefect.states import Crashed

    unfinished = {"state": {"type": {"any_": ["RUNNING", "PENDING", "CANCELLING"]}}}
    crashed: State[Any] = Crashed(message="Its process ended without saying so.")
    with SyncPrefectClient(url) as client:
        for task in client.read_task_runs(task_run_filter=TaskRunFilter.model_validate(unfinished)):
            client.set_task_run_state(task.id, crashed, force=True)
        for flow in client.read_flow_runs(flow_run_filter=FlowRunFilter.model_validate(unfinished)):
            client.set_flow_run_state(flow.id, crashed)


def _spawn_server(home: Home, port: int) -> subprocess.Popen[bytes]:
    listener = listen(port)
    url = f"http://{HOST}:{listener.getsockname()[1]}/api"
    environment = {
        **SERVER_DEFAULTS,
        DATABASE: f"sqlite+aiosqlite:///{home.prefect / 'prefect.db'}",
        **os.environ,
        "PREFECT_HOME": str(home.prefect),
        "PREFECT_API_URL": url,
        "PREFECT_LOGGING_HANDLERS_CONSOLE_LEVEL": "DEBUG",  # the log file takes what the terminal does not
        "DO_NOT_TRACK": "1",
    }
    descriptor = listener.fileno()
    module = ["plancurate.flows.server.prefect_app", str(descriptor)]
    lifetime = ["--users", str(home.prefect / "users.lock")]
    lifetime += ["--own", str(home.prefect / "server.lock"), "--url", url]
    with listener:
        return spawn(module, home.prefect / "server.log", environment, lifetime, descriptors=[descriptor])


def _leave(home: Home, users: IO[str]) -> None:
    """Stop the server, where it still runs, unless somebody else uses it."""
    if not try_lock(users, fcntl.LOCK_EX):
        return
    pid, _ = serving(home) or (0, "")
    if pid:
        os.killpg(pid, signal.SIGTERM)
    deadline = time.monotonic() + STOP_TIMEOUT_S  # the lock is held meanwhile: nobody joins a dying server
    while serving(home) and time.monotonic() < deadline:
        time.sleep(0.02)
    for process in started:
        process.poll()
