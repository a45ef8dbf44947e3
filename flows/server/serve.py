"""The services of `plancurate serve`: Prefect's server, MLflow's pages and a worker with every deployment."""

from __future__ import annotations

import importlib
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from plancurate.errors import PlancurateError
from plancurate.flows.server.deployments import POOL, deploy
from plancurate.flows.server.own_server import serving
from plancurate.flows.server.prefect_server import prefect_server
from plancurate.flows.server.services import HOST, free_port, healthy, last_line, spawn, stop
from plancurate.tasks.lake.home import Home

PREFECT_PORT = 4200
MLFLOW_PORT = 5000
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


@contextmanager
def services(home: Home) -> Iterator[tuple[dict[str, str], Services]]:
    """Addresses of the pages (`prefect`, `mlflow`) and the services behind them, once all of them answer.

    Raises PlancurateError where one of them does not start.
    """
    os.environ.update(SERVER_ENVIRONMENT | os.environ)
    with (
        prefect_server(home, PREFECT_PORT, meanwhile=lambda: importlib.import_module("mlflow")) as api,
        _mlflow(home) as (mlflow_url, mlflow),
        _worker(home) as worker,
    ):
        running = {**_own_server(home, api), **mlflow, **worker}
        _wait_for(mlflow_url, running)
        yield {"prefect": api.removesuffix("/api"), "mlflow": mlflow_url}, running


def watch(running: Services) -> None:
    """Return never; PlancurateError when one of the services ends."""
    while True:
        _check(running)
        time.sleep(0.5)


def _own_server(home: Home, api: str) -> Services:
    """The home's own Prefect server, unless `api` is the URL of a configured one."""
    if (serving(home) or (0, ""))[1] != api:
        return {}
    return {home.prefect / "server.log": lambda: serving(home) is not None}


@contextmanager
def _mlflow(home: Home) -> Iterator[tuple[str, Services]]:
    """MLflow's address and, unless it is a configured server's, the service behind it."""
    from plancurate.tasks.study.mlflow_store import ensure_store, is_server

    store = ensure_store(home.mlflow_db)
    if is_server(store):
        yield store, {}
        return
    port = free_port(MLFLOW_PORT)
    url = f"http://{HOST}:{port}"
    command = ["mlflow", "server", "--default-artifact-root", home.artifacts.as_uri()]
    command += ["--host", HOST, "--port", str(port), "--workers", "1"]
    # A store's address may hold a password, and everybody on a machine sees command lines.
    variables = {**MLFLOW_ENVIRONMENT, "MLFLOW_BACKEND_STORE_URI": store}
    with _service(home.prefect / "mlflow.log", command, variables) as service:
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


def _wait_for(url: str, running: Services) -> None:
    deadline = time.monotonic() + START_TIMEOUT_S
    while not healthy(url):
        _check(running)
        if time.monotonic() > deadline:
            raise PlancurateError(f"{url}: no answer after {START_TIMEOUT_S:.0f} s")
        time.sleep(0.1)


def _check(running: Services) -> None:
    for log, is_running in running.items():
        if not is_running():
            raise PlancurateError(f"{log}: this service ended by itself; its last words: {last_line(log)}")
