"""`plancurate serve`: Prefect's server, MLflow's pages and a worker with every deployment, until Ctrl-C."""

from __future__ import annotations

import fcntl
import os
import signal
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import IO

from plancurate.errors import PlancurateError
from plancurate.flows.cli.console import console
from plancurate.flows.cli.options import HomeOptions
from plancurate.flows.server.deployments import POOL, deploy
from plancurate.flows.server.locks import read_note, try_lock, write_note
from plancurate.flows.server.own_server import serving
from plancurate.flows.server.prefect_server import prefect_server
from plancurate.flows.server.services import HOST, free_port, healthy, last_line, spawn, stop
from plancurate.tasks.lake.home import Home

PREFECT_PORT = 4200
MLFLOW_PORT = 5000
MLFLOW_PAGE = "#/experiments?workflowType=machine_learning"
START_TIMEOUT_S = 120.0

# Who looks at Prefect's pages wants its event feed and automations; a run's own server does without.
SERVER_ENVIRONMENT = {
    "PREFECT_SERVER_SERVICES_EVENT_PERSISTER_ENABLED": "true",
    "PREFECT_SERVER_SERVICES_TRIGGERS_ENABLED": "true",
}
WORKER_ENVIRONMENT = {
    "PREFECT_WORKER_QUERY_SECONDS": "2",  # what is started on a page should start soon
    "PREFECT_LOGGING_HANDLERS_CONSOLE_LEVEL": "DEBUG",  # a worker's console is its log file
}
MLFLOW_ENVIRONMENT = {"MLFLOW_DISABLE_TELEMETRY": "true", "MLFLOW_SERVER_ENABLE_JOB_EXECUTION": "false"}

Services = dict[Path, Callable[[], bool]]
"""Log files of services, each with a function that says whether its service is running."""


def serve(options: HomeOptions = HomeOptions()) -> None:
    """Show Prefect's and MLflow's pages and run what is started or scheduled there, until Ctrl-C."""
    home = options.folder()
    home.prefect.mkdir(parents=True, exist_ok=True)
    path = home.prefect / "serve.lock"
    with path.open("a+") as file:
        while not try_lock(file, fcntl.LOCK_EX):
            if (note := read_note(path)) is not None:
                console.print(_running(home, note), soft_wrap=True, highlight=False)
                return
        write_note(file, {})
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, _interrupt)
        try:
            _serve(home, file)
        except KeyboardInterrupt:
            console.print("stopped")


def _interrupt(_signal: int, _frame: FrameType | None) -> None:
    for number in (signal.SIGINT, signal.SIGTERM):  # a second Ctrl-C must not stop the stopping
        signal.signal(number, signal.SIG_IGN)
    raise KeyboardInterrupt


def _serve(home: Home, note: IO[str]) -> None:
    """Run the services and say so in the locked file; PlancurateError when one of them ends."""
    os.environ.update(SERVER_ENVIRONMENT | os.environ)
    with (
        console.status("starting") as status,
        prefect_server(home, PREFECT_PORT, preload=["mlflow"]) as api,
        _mlflow(home) as (mlflow_url, mlflow),
        _worker(home) as worker,
    ):
        services = {**_own_server(home, api), **mlflow, **worker}
        _wait_for(mlflow_url, services)
        pages = {"prefect": api.removesuffix("/api"), "mlflow": mlflow_url}
        write_note(note, pages)
        status.stop()
        console.print(_overview(home, **pages), soft_wrap=True, highlight=False)
        while True:
            _check(services)
            time.sleep(0.5)


def _own_server(home: Home, api: str) -> Services:
    """The home's own Prefect server, unless `api` is the URL of a configured one."""
    if (serving(home) or (0, ""))[1] != api:
        return {}
    return {home.prefect / "server.log": lambda: serving(home) is not None}


@contextmanager
def _mlflow(home: Home) -> Iterator[tuple[str, Services]]:
    """MLflow's address and, unless it is a configured server's, the service behind it."""
    from plancurate.tasks.study.tracking import ensure_store

    store = ensure_store(home.mlflow_db)
    if store.startswith("http"):
        yield store, {}
        return
    port = free_port(MLFLOW_PORT)
    url = f"http://{HOST}:{port}"
    command = ["mlflow", "server", "--backend-store-uri", store, "--default-artifact-root"]
    command += [home.artifacts.as_uri(), "--host", HOST, "--port", str(port), "--workers", "1"]
    with _service(home.prefect / "mlflow.log", command, MLFLOW_ENVIRONMENT) as service:
        yield url, service


@contextmanager
def _worker(home: Home) -> Iterator[Services]:
    """A worker that runs every deployment on this home."""
    deploy(home.prefect / "deploy.log")
    command = ["prefect", "worker", "start", "--pool", POOL, "--type", "process", "--name", "plancurate"]
    variables = {**WORKER_ENVIRONMENT, "PLANCURATE_HOME": str(home.root)}
    with _service(home.prefect / "worker.log", command, variables) as service:
        yield service


@contextmanager
def _service(log: Path, module: Sequence[str], variables: Mapping[str, str]) -> Iterator[Services]:
    process = spawn(module, log, {**os.environ, **variables}, ["--parent", str(os.getpid())])
    try:
        yield {log: lambda: process.poll() is None}
    finally:
        stop(process)


def _wait_for(url: str, services: Services) -> None:
    deadline = time.monotonic() + START_TIMEOUT_S
    while not healthy(url):
        _check(services)
        if time.monotonic() > deadline:
            raise PlancurateError(f"{url}: no answer after {START_TIMEOUT_S:.0f} s")
        time.sleep(0.1)


def _check(services: Services) -> None:
    for log, is_running in services.items():
        if not is_running():
            raise PlancurateError(f"{log}: this service ended by itself; its last words: {last_line(log)}")


def _running(home: Home, note: Mapping[str, str]) -> str:
    """Who serves the home already."""
    pages = f"Prefect {note['prefect']}, MLflow {note['mlflow']}" if "mlflow" in note else "just starting"
    return f"{home.root} is served already by process {note.get('pid', 'unknown')}: {pages}"


def _overview(home: Home, prefect: str, mlflow: str) -> str:
    return "\n".join(
        (
            f"[bold]Prefect[/]  {prefect}  [dim]runs, schedules; start one under Deployments[/]",
            f"[bold]MLflow[/]   {mlflow}/{MLFLOW_PAGE}  [dim]studies, their runs and models[/]",
            f"[bold]Home[/]     {home.root}  [dim]lake, databases, log files in prefect/[/]",
            "Ctrl-C stops everything",
        )
    )
