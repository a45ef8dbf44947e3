"""What Prefect's page of a run shows beside its task runs: lines, progress, tables, texts.

The stages of a study are runs with pages of their own, but a person looks at the page of the run that was started. So
everything goes to that one.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any
from uuid import UUID

from prefect.artifacts import (
    Artifact,
    MarkdownArtifact,
    ProgressArtifact,
    TableArtifact,
    update_progress_artifact,
)
from prefect.context import FlowRunContext
from rich.text import Text

from plancurate.errors import IncompleteError, PlancurateError
from plancurate.flows.cli.console import console

STEP = 0.05

_started: ContextVar[UUID | None] = ContextVar("_started", default=None)
_log = logging.getLogger("plancurate.run_page")
_log.setLevel(
    logging.INFO
)  # other loggers keep to warnings: Prefect's would write two lines for each task run


def _for_a_person(record: logging.LogRecord) -> bool:
    """Make what Prefect logs of a mistake of a user's its one sentence, and leave out what nobody can act on."""
    error = record.exc_info[1] if record.exc_info else None
    if isinstance(error, (PlancurateError, IncompleteError)):
        again = str(record.msg).startswith("Engine execution")  # the same error once more, from further out
        record.msg, record.args, record.exc_info = "%s", (str(error),), None
        return not again
    return not str(record.msg).startswith("Timeout of")  # limits of tasks hold in processes, not in threads


for name in ("prefect.flow_runs", "prefect.task_runs"):
    logging.getLogger(name).addFilter(_for_a_person)


@contextmanager
def one_page() -> Iterator[None]:
    """Show what the runs within this flow run have to show on its own page."""
    token = _started.set(_page())
    try:
        yield
    finally:
        _started.reset(token)


def _page() -> UUID | None:
    """Id of the flow run that was started; None outside of any."""
    context = FlowRunContext.get()
    own = context.flow_run.id if context is not None and context.flow_run is not None else None
    return _started.get() or own


def tell(line: str, style: str = "") -> None:
    """Print a line with Rich's marks on the terminal and write it to the page's log without them."""
    console.print(line, style=style, highlight=False, soft_wrap=True)
    write_log(Text.from_markup(line).plain)


def write_log(line: str) -> None:
    """Write a line to the page's log alone."""
    if (page := _page()) is not None:
        _log.info(line.strip(), extra={"flow_run_id": page})


class PageProgress:
    """A stage's progress; silent outside a flow run."""

    def __init__(self, title: str, share: float) -> None:
        self._shown = share
        self._id = _show(
            ProgressArtifact(
                progress=100 * share, key=f"{title}-progress", description=f"Progress of {title}"
            )
        )

    def show(self, share: float) -> None:
        """Update the page once another twentieth is done: each update costs a request."""
        if self._id is not None and (share >= 1 or share - self._shown >= STEP):
            self._shown = share
            update_progress_artifact(self._id, 100 * min(share, 1.0))


def show_table(key: str, rows: list[dict[str, Any]], description: str) -> None:
    """Show rows as a table, without its empty columns, under a key whose versions can be compared from run to run."""
    filled = {name for row in rows for name, value in row.items() if value not in (None, "")}
    table = [{name: value for name, value in row.items() if name in filled} for row in rows]
    _show(TableArtifact(table=table, key=key, description=description))


def show_text(key: str, text: str, description: str) -> None:
    """Show Markdown under a key."""
    _show(MarkdownArtifact(markdown=text, key=key, description=description))


def _show(artifact: Artifact) -> UUID | None:
    """Put an artifact on the page; returns its id, or None outside of any flow run."""
    if (page := _page()) is None:
        return None
    artifact.flow_run_id = page
    shown: Any = artifact.create()  # without an event loop the call is an ordinary one
    return UUID(str(shown.id))
