"""`make serve`: Prefect's server, MLflow's pages and a worker with every deployment, until Ctrl-C."""

from __future__ import annotations

import argparse
import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from rich.console import Console

from plancurate.errors import PlancurateError
from plancurate.flows.server.prefect_server import prefect_server
from plancurate.flows.server.services import HOST, free_port, healthy, last_line, spawn_guarded, stop
from plancurate.tasks.lake.home import Home

if TYPE_CHECKING:
    from prefect.client.schemas.actions import WorkPoolCreate

POOL = "plancurate"
PREFECT_PORT = 4200
MLFLOW_PORT = 5000
MLFLOW_PAGE = "#/experiments?workflowType=machine_learning"
START_TIMEOUT_S = 120.0
DEPLOY = [sys.executable, "-m", "prefect", "--no-prompt", "deploy", "--all"]

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

console = Console(stderr=True, highlight=False)


def main(argv: Sequence[str] | None = None) -> int:
    """Serve until Ctrl-C (0), or until something goes wrong: one line and 2."""
    parser = argparse.ArgumentParser(prog="plancurate.flows.server.serve", description=__doc__)
    parser.add_argument("--home", help="folder with the lake and the databases (PLANCURATE_HOME, ./data)")
    home = Home.resolve(parser.parse_args(argv).home)
    os.environ.update(SERVER_ENVIRONMENT | os.environ)
    try:
        serve(home, Path.cwd())
    except KeyboardInterrupt:
        console.print("stopped")
    except PlancurateError as error:
        console.print(f"[red]plancurate:[/] {error}", soft_wrap=True)
        return 2
    return 0


def serve(home: Home, root: Path) -> None:
    """Run the services with the deployments of `root`/prefect.yaml; PlancurateError when one of them ends."""
    if not (root / "prefect.yaml").exists():
        raise PlancurateError(f"{root / 'prefect.yaml'}: no such file; serve from the repository's root")
    with (
        console.status("starting") as status,
        prefect_server(home, PREFECT_PORT, preload=["mlflow"]) as api,
        _mlflow(home) as (mlflow_url, services),
        _worker(home, root) as worker,
    ):
        _wait_for(mlflow_url, services, home)
        status.stop()
        console.print(_overview(home, api.removesuffix("/api"), mlflow_url), soft_wrap=True)
        _watch({**services, "worker": worker}, home)


def deploy(home: Home, root: Path) -> None:
    """Create the work pool and register every deployment of `root`/prefect.yaml.

    A schedule that somebody switched on stays on: the file only says how it starts out.
    """
    from prefect.client.orchestration import get_client

    log = home.prefect / "deploy.log"
    with get_client(sync_client=True) as client:
        client.create_work_pool(_work_pool(), overwrite=True)
        deployments = client.read_deployments()
        switched_on = [(item.id, plan.id) for item in deployments for plan in item.schedules if plan.active]
        with log.open("wb") as output:
            done = subprocess.run(DEPLOY, cwd=root, stdout=output, stderr=output, check=False)
        if done.returncode:
            raise PlancurateError(f"{log}: prefect deploy failed: {last_line(log)}")
        for deployment, schedule in switched_on:
            client.update_deployment_schedule(deployment, schedule, active=True)


def _work_pool() -> WorkPoolCreate:
    """A pool of processes that stay in their worker's process group, so that they end with it."""
    from prefect.client.schemas.actions import WorkPoolCreate
    from prefect.workers.process import ProcessWorker

    template = ProcessWorker.get_default_base_job_template()
    # Left to itself, a worker starts each run in a session of its own, where it outlives a killed worker.
    template["variables"]["properties"]["command"]["default"] = shlex.join(
        [sys.executable, "-m", "prefect.engine"]
    )
    description = "Processes on the machine of make serve."
    return WorkPoolCreate(name=POOL, type="process", base_job_template=template, description=description)


def _interrupt(_signal: int, _frame: FrameType | None) -> None:
    for number in (signal.SIGINT, signal.SIGTERM):  # a second Ctrl-C must not stop the stopping
        signal.signal(number, signal.SIG_IGN)
    raise KeyboardInterrupt


@contextmanager
def _mlflow(home: Home) -> Iterator[tuple[str, dict[str, subprocess.Popen[bytes]]]]:
    """MLflow's address and, unless it is a configured server's, the process that serves it."""
    from plancurate.tasks.study.tracking import ensure_store

    store = ensure_store(home.mlflow_db)
    if store.startswith("http"):
        yield store, {}
        return
    port = free_port(MLFLOW_PORT)
    url = f"http://{HOST}:{port}"
    command = ["mlflow", "server", "--backend-store-uri", store, "--default-artifact-root"]
    command += [home.artifacts.as_uri(), "--host", HOST, "--port", str(port), "--workers", "1"]
    with _service(home, "mlflow", command, MLFLOW_ENVIRONMENT) as process:
        yield url, {"mlflow": process}


@contextmanager
def _worker(home: Home, root: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A worker that runs the deployments of `root`/prefect.yaml on this home."""
    deploy(home, root)
    command = ["prefect", "worker", "start", "--pool", POOL, "--type", "process", "--name", "plancurate"]
    variables = {**WORKER_ENVIRONMENT, "PLANCURATE_HOME": str(home.root)}
    with _service(home, "worker", command, variables) as process:
        yield process


def _wait_for(url: str, services: Mapping[str, subprocess.Popen[bytes]], home: Home) -> None:
    deadline = time.monotonic() + START_TIMEOUT_S
    while services and not healthy(url):
        _check(services, home)
        if time.monotonic() > deadline:
            raise PlancurateError(f"{url}: no answer after {START_TIMEOUT_S:.0f} s; see {home.prefect}/*.log")
        time.sleep(0.1)


@contextmanager
def _service(
    home: Home, name: str, command: Sequence[str], variables: Mapping[str, str]
) -> Iterator[subprocess.Popen[bytes]]:
    process = spawn_guarded(home, command, home.prefect / f"{name}.log", {**os.environ, **variables})
    try:
        yield process
    finally:
        stop(process)


def _watch(services: Mapping[str, subprocess.Popen[bytes]], home: Home) -> None:
    while True:
        _check(services, home)
        time.sleep(0.5)


def _check(services: Mapping[str, subprocess.Popen[bytes]], home: Home) -> None:
    for name, process in services.items():
        if process.poll() is not None:
            log = home.prefect / f"{name}.log"
            raise PlancurateError(f"{log}: the {name} service ended by itself: {last_line(log)}")


def _overview(home: Home, prefect_url: str, mlflow_url: str) -> str:
    return "\n".join(
        (
            f"[bold]Prefect[/]  {prefect_url}  [dim]runs, schedules; start one under Deployments[/]",
            f"[bold]MLflow[/]   {mlflow_url}/{MLFLOW_PAGE}  [dim]studies, their runs and models[/]",
            f"[bold]Home[/]     {home.root}  [dim]lake, databases, log files in prefect/[/]",
            "Ctrl-C stops everything",
        )
    )


if __name__ == "__main__":
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _interrupt)
    sys.exit(main())
