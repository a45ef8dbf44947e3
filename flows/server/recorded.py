"""Know which task runs ended in this process, and wait until the server has recorded them.

Prefect's client sends the states of task runs as events from a thread of its own, and the server records them
in batches; a server that is stopped in between forgets them.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from unittest.mock import patch

from httpx import TransportError
from prefect.client.orchestration import SyncPrefectClient
from prefect.client.schemas.objects import TERMINAL_STATES
from prefect.events import Event
from prefect.events.worker import EventsWorker
from prefect.logging.handlers import APILogWorker

from plancurate.flows.cli.console import console

TIMEOUT_S = 60.0
CHUNK = 200  # ids in one question
FINAL = [state.value for state in TERMINAL_STATES]


@contextmanager
def everything_recorded(url: str) -> Iterator[None]:
    """In the end, send what is left and wait until the API at `url` lists every task run that ended."""
    ended: set[str] = set()
    send = EventsWorker.send

    def witnessed_send(worker: EventsWorker, event: Event) -> None:
        kind, _, task_run_id = event.resource.id.rpartition(".")
        if kind == "prefect.task-run" and event.resource.get("prefect.state-type") in FINAL:
            ended.add(task_run_id)
        send(worker, event)

    with patch.object(EventsWorker, "send", witnessed_send):  # all events pass there; Prefect offers no hook
        try:
            yield
        finally:
            EventsWorker.drain_all()
            APILogWorker.drain_all()
            if missing := _wait_until_recorded(url, sorted(ended)):
                said = f"Prefect did not record {missing} task runs; the lake has their results"
                console.print(said, style="yellow", highlight=False, soft_wrap=True)


def _wait_until_recorded(url: str, ids: list[str]) -> int:
    """Wait for the ids, chunk by chunk, and return how many are missing when the time is up."""
    deadline = time.monotonic() + TIMEOUT_S
    chunks = [ids[first : first + CHUNK] for first in range(0, len(ids), CHUNK)]
    with SyncPrefectClient(url) as client:
        return sum(_missing(client, chunk, deadline) for chunk in chunks)


def _missing(client: SyncPrefectClient, chunk: list[str], deadline: float) -> int:
    """Wait for one chunk and return how many are missing when the time is up or the server is gone."""
    question = {"task_runs": {"id": {"any_": chunk}, "state": {"type": {"any_": FINAL}}}}
    recorded = 0
    with suppress(TransportError):
        while (recorded := client.request("POST", "/task_runs/count", json=question).json()) < len(chunk):
            if time.monotonic() > deadline:
                break
            time.sleep(0.1)
    return len(chunk) - recorded
