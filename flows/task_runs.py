"""Many task runs at once without flooding Prefect: a bounded number in flight, and no silent losses."""

from __future__ import annotations

from collections.abc import Iterable
from threading import BoundedSemaphore
from typing import Any

from prefect import Task

from plancurate.errors import IncompleteError, PlancurateError


def is_transient(task: object, task_run: object, state: Any) -> bool:
    """Say whether trying again can help: a full disk or a busy file may pass, a mistake in the input does not."""
    return isinstance(state.result(raise_on_failure=False), OSError)


def run_all(task: Task[..., Any], calls: Iterable[tuple[Any, ...]], in_flight: int) -> list[Any]:
    """Run a task once for each call's arguments, at most `in_flight` at once; return the results in order.

    Raises the first PlancurateError among the children as it is, or IncompleteError that counts all failures:
    a flow that returns a value counts as completed whatever became of its children, so this looks at each.
    """
    slots, futures = BoundedSemaphore(in_flight), []
    for call in calls:
        slots.acquire()
        future = task.submit(*call)
        future.add_done_callback(lambda _: slots.release())
        futures.append(future)
    results = [future.result(raise_on_failure=False) for future in futures]
    errors = [result for result in results if isinstance(result, BaseException)]
    for error in errors:
        if isinstance(error, PlancurateError):
            raise error
    if errors:
        raise IncompleteError(
            f"{len(errors)} of {len(results)} '{task.name}' runs failed, the first with "
            f"{type(errors[0]).__name__}: {errors[0]}; run the same command again to do the rest"
        ) from errors[0]
    return results
