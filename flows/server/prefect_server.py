"""A real Prefect server for the time of a run, shared by all runs on one home.

Prefect's own ephemeral server loses task runs and prints tracebacks when it is shut down; without any API URL
there is nothing that a user could open later. So a run without a configured API starts a server process on
127.0.0.1 with its database in the home folder. Runs on the same home share it, and the last one ends it.
"""

from __future__ import annotations

import fcntl
import importlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from plancurate.errors import PlancurateError
from plancurate.flows.server.services import (
    HOST,
    STOP_TIMEOUT_S,
    free_port,
    healthy,
    last_line,
    lock,
    spawn_guarded,
    started,
    users_lock,
)
from plancurate.tasks.lake.home import Home

if TYPE_CHECKING:
    from prefect.client.schemas.objects import State

START_TIMEOUT_S = 120.0

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

CLIENT_DEFAULTS = {
    "PREFECT_LOGGING_LEVEL": "WARNING",  # two lines a task run cost more than they tell: its states say the same
    "DO_NOT_TRACK": "1",
    "PREFECT_LOGGING_HANDLERS_CONSOLE_LEVEL": "CRITICAL",  # run logs go to the API, not to the terminal
    "PREFECT_LOGGING_EXTRA_LOGGERS": "plancurate",
    "PREFECT_LOGGING_TO_API_WHEN_MISSING_FLOW": "ignore",
}


@contextmanager
def prefect_server(home: Home, port: int = 0, preload: Sequence[str] = ()) -> Iterator[str]:
    """Prefect's API URL, set for this process and its children while the context lasts.

    A configured `PREFECT_API_URL` (environment or profile) is used as it is. Otherwise the home's own server
    is joined or started on `port` (0: any free one). `preload` names modules to import while it starts.
    Raises PlancurateError where the configured API does not answer or the server does not start.
    """
    with _environment(CLIENT_DEFAULTS):
        if configured := configured_url():
            check_reachable(configured)
            yield configured
            return
        with _own_server(home, port, preload) as url, _environment(_client_settings(home, url)):
            from prefect.settings import temporary_settings

            from plancurate.flows.server.recorded import everything_recorded

            # Heartbeats show a server which runs of its workers crashed; each costs its flow up to a second.
            with temporary_settings({"flows.heartbeat_frequency": None}), everything_recorded(url):
                yield url


@contextmanager
def _environment(variables: Mapping[str, str]) -> Iterator[None]:
    """Environment variables for this process, its children and, where it is imported already, Prefect."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    _refresh_prefect()
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.__setitem__(name, value)
        _refresh_prefect()


def _refresh_prefect() -> None:
    if "prefect.context" in sys.modules:
        from prefect.context import refresh_global_settings_context

        refresh_global_settings_context()
    if "prefect.main" in sys.modules:
        from prefect.logging.configuration import setup_logging

        setup_logging()


def _client_settings(home: Home, url: str) -> dict[str, str]:
    return {"PREFECT_API_URL": url, "PREFECT_RESULTS_LOCAL_STORAGE_PATH": str(home.prefect / "results")}


def configured_url() -> str | None:
    """The API URL that the environment or one of Prefect's files sets."""
    if "prefect.context" not in sys.modules and not _may_be_configured():
        return None  # known without importing Prefect, which takes a third of the time of the server's start
    from prefect.settings import PREFECT_API_URL

    url: str | None = PREFECT_API_URL.value()
    return url


def _may_be_configured() -> bool:
    """Whether there is anything that Prefect would read settings like an API URL from."""
    profiles = Path(os.environ.get("PREFECT_HOME", "~/.prefect"), "profiles.toml").expanduser()
    files = (Path(os.environ.get("PREFECT_PROFILES_PATH", profiles)), Path(".env"), Path("prefect.toml"))
    named = any(name in os.environ for name in ("PREFECT_API_URL", "PREFECT_PROFILE"))
    pyproject = Path("pyproject.toml")
    described = pyproject.exists() and "[tool.prefect" in pyproject.read_text()
    return named or described or any(file.exists() for file in files)


def check_reachable(url: str) -> None:
    """Raise PlancurateError unless a Prefect API answers at the URL."""
    from prefect.client.orchestration import get_client

    with get_client(httpx_settings={"timeout": 5.0}, sync_client=True) as client:
        problem = client.api_healthcheck()
    if problem is not None:
        raise PlancurateError(
            f"PREFECT_API_URL={url}: no Prefect API answers there ({problem}); "
            "start that server, or unset the variable to let the command run its own"
        )


@contextmanager
def _own_server(home: Home, port: int, preload: Sequence[str]) -> Iterator[str]:
    home.prefect.mkdir(parents=True, exist_ok=True)
    with users_lock(home) as users:
        pid, url = _join_or_start(home, port, preload)
        try:
            yield url
        finally:
            _leave(home, users, pid)


def _join_or_start(home: Home, port: int, preload: Sequence[str]) -> tuple[int, str]:
    """Process id and API URL of the home's server, once it answers."""
    with (home.prefect / "start.lock").open("a") as start:
        lock(start, fcntl.LOCK_EX, START_TIMEOUT_S)
        process = None if _serving(home) else _spawn_server(home, port)
        for module in preload:
            importlib.import_module(module)
        deadline = time.monotonic() + START_TIMEOUT_S
        while time.monotonic() < deadline:
            pid, url = _serving(home) or (0, "")
            if url and healthy(url):
                if process is not None:
                    _crash_dead_runs(url)
                return pid, url
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


def _serving(home: Home) -> tuple[int, str] | None:
    """Process id and API URL of the server that holds the home's server lock, if one does."""
    with (home.prefect / "server.lock").open("a+") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            file.seek(0)
            try:
                note = json.load(file)
            except json.JSONDecodeError:  # locked a moment ago, not yet written
                return 0, ""
            return note["pid"], note["url"]
    return None


def _spawn_server(home: Home, port: int) -> subprocess.Popen[bytes]:
    port = free_port(port)
    url = f"http://{HOST}:{port}/api"
    database = f"sqlite+aiosqlite:///{home.prefect / 'prefect.db'}"
    environment = {
        **SERVER_DEFAULTS,
        "PREFECT_API_DATABASE_CONNECTION_URL": database,
        **os.environ,
        "PREFECT_HOME": str(home.prefect),
        "PREFECT_API_URL": url,
        "PREFECT_LOGGING_HANDLERS_CONSOLE_LEVEL": "DEBUG",  # the log file takes what the terminal does not
        "DO_NOT_TRACK": "1",
    }
    options = ["--own", str(home.prefect / "server.lock"), "--url", url]
    uvicorn = ["uvicorn", "--factory", "prefect.server.api.server:create_app", "--host", HOST]
    uvicorn += ["--port", str(port), "--log-level", "warning", "--timeout-graceful-shutdown", "5"]
    return spawn_guarded(home, uvicorn, home.prefect / "server.log", environment, options)


def _leave(home: Home, users: IO[str], pid: int) -> None:
    """Stop the server unless somebody else uses it."""
    try:  # the lock is held until the server is gone: nobody joins a dying one
        fcntl.flock(users, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return
    os.killpg(pid, signal.SIGTERM)
    deadline = time.monotonic() + STOP_TIMEOUT_S
    while _serving(home) and time.monotonic() < deadline:
        time.sleep(0.02)
    for process in started:
        process.poll()
