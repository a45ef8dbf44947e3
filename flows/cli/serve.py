"""The command that serves a home: both pages and a worker, until Ctrl-C."""

from __future__ import annotations

import fcntl
import signal
from collections.abc import Mapping
from types import FrameType
from typing import IO

from rich.markup import escape

from plancurate.errors import shown
from plancurate.flows.cli.console import console
from plancurate.flows.cli.options import HomeOptions
from plancurate.flows.server.serve import services, watch
from plancurate.locks import read_note, try_lock, write_note
from plancurate.tasks.lake.home import Home

MLFLOW_PAGE = "#/experiments?workflowType=machine_learning"


def serve(options: HomeOptions = HomeOptions()) -> None:
    """Show Prefect's and MLflow's pages and run what is started or scheduled there, until Ctrl-C."""
    home = options.folder()
    home.prefect.mkdir(parents=True, exist_ok=True)
    path = home.prefect / "serve.lock"
    with path.open("a+") as file:
        while not try_lock(file, fcntl.LOCK_EX):
            if (note := read_note(path)) is not None:
                console.print(_who_serves(home, note), soft_wrap=True, highlight=False, markup=False)
                return
        try:
            _serve(home, file)
        except KeyboardInterrupt:
            console.print("stopped")


def _serve(home: Home, file: IO[str]) -> None:
    """Serve, and say in the locked file who does so where."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _interrupt)
    write_note(file, {})
    with console.status("starting") as status, services(home) as (addresses, running):
        pages = {name: shown(address) for name, address in addresses.items()}
        write_note(file, pages)
        status.stop()
        console.print(_overview(home, **pages), soft_wrap=True, highlight=False)
        watch(running)


def _interrupt(_signal: int, _frame: FrameType | None) -> None:
    for number in (signal.SIGINT, signal.SIGTERM):  # a second Ctrl-C must not stop the stopping
        signal.signal(number, signal.SIG_IGN)
    raise KeyboardInterrupt


def _who_serves(home: Home, note: Mapping[str, str]) -> str:
    pages = f"Prefect {note['prefect']}, MLflow {note['mlflow']}" if "mlflow" in note else "just starting"
    return f"{home.root} is served already by process {note.get('pid', 'unknown')}: {pages}"


def _overview(home: Home, prefect: str, mlflow: str) -> str:
    return "\n".join(
        (
            f"[bold]Prefect[/]  {prefect}  [dim]runs, schedules; start one under Deployments[/]",
            f"[bold]MLflow[/]   {mlflow}/{MLFLOW_PAGE}  [dim]studies, their runs and models[/]",
            f"[bold]Home[/]     {escape(str(home.root))}  [dim]lake, databases, log files in prefect/[/]",
            "Ctrl-C stops everything",
        )
    )
