"""What Prefect's pages show beside the task runs: progress, tables, links."""

from __future__ import annotations

from typing import Any, cast
from uuid import UUID

from prefect.artifacts import create_progress_artifact, create_table_artifact, update_progress_artifact
from prefect.context import FlowRunContext

STEP = 0.05


class ProgressArtifact:
    """A stage's progress on the flow run's page; silent outside a flow run."""

    def __init__(self, title: str) -> None:
        self._shown = 0.0
        self._id: UUID | None = None
        if FlowRunContext.get() is not None:
            created = create_progress_artifact(0.0, f"{title}-progress", f"Progress of {title}")
            self._id = cast("UUID", created)  # without an event loop the call is an ordinary one

    def show(self, share: float) -> None:
        """Update the page once another twentieth is done: each update costs a request."""
        if self._id is not None and (share >= 1 or share - self._shown >= STEP):
            self._shown = share
            update_progress_artifact(self._id, 100 * min(share, 1.0))


def table_artifact(key: str, rows: list[dict[str, Any]], description: str) -> None:
    """Show rows as a table under a key whose versions a reader can compare from run to run."""
    create_table_artifact(rows, key=key, description=description)
