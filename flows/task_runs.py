"""Many task runs at once without flooding Prefect: a bounded number in flight, and no silent losses."""

from __future__ import annotations

import os
import socket
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from contextvars import ContextVar
from queue import SimpleQueue
from typing import Any
from urllib.parse import urlsplit
from uuid import UUID

from prefect import Task
from prefect.context import FlowRunContext
from prefect.futures import PrefectFuture
from prefect.task_runners import ProcessPoolTaskRunner, TaskRunner, ThreadPoolTaskRunner
from prefect.utilities.callables import get_call_parameters

from plancurate.errors import IncompleteError, PlancurateError
from plancurate.tasks.study.config import StudyConfig
from plancurate.tasks.study.context import StudyContext, reference
from plancurate.tasks.study.networks import Network, groups, titles

Ended = Callable[[Any], None]
REACH_TIMEOUT_S = 5.0
RAY_STORE_BYTES = 100_000_000  # little more than the least that it accepts

_shared: ContextVar[TaskRunner[Any] | None] = ContextVar("_shared", default=None)


@contextmanager
def shared_runner(config: StudyConfig) -> Iterator[TaskRunner[Any]]:
    """Where a study's task runs work: the runner of the outermost such context, which ends with it.

    Stages of one study share it, for each new runner of processes starts them and lets them import torch.
    PlancurateError where the cluster that the study names does not answer.
    """
    if shared := _shared.get():
        yield shared
        return
    with ExitStack() as stack:
        try:
            runner = stack.enter_context(task_runner(config))
        except OSError as error:
            reason = " ".join(str(error).split())
            raise PlancurateError(f"runner = {config.runner}: no cluster: {reason}") from None
        token = _shared.set(runner)
        try:
            yield runner
        finally:
            _shared.reset(token)


def task_runner(config: StudyConfig) -> TaskRunner[Any]:
    """Return where a study's task runs work; PlancurateError when what is asked for is not installed."""
    if config.runner == "threads":
        return ThreadPoolTaskRunner()
    if config.runner == "processes":
        return ProcessPoolTaskRunner(max_workers=config.workers)
    try:
        return dask_runner(config) if config.runner == "dask" else ray_runner(config)
    except ImportError:
        missing = config.runner.capitalize()
        raise PlancurateError(
            f"runner = {config.runner}: {missing} is missing; pip install 'plancurate[{config.runner}]'"
        ) from None


def dask_runner(config: StudyConfig) -> TaskRunner[Any]:
    """Return a runner on the study's Dask cluster, or on a local one of so many processes."""
    from prefect_dask.task_runners import DaskTaskRunner

    if config.dask_scheduler:
        require_answer(config.dask_scheduler)
        return DaskTaskRunner(address=config.dask_scheduler)
    quiet = {"dashboard_address": None, "silence_logs": "ERROR"}
    return DaskTaskRunner(cluster_kwargs={"n_workers": config.workers, "threads_per_worker": 1, **quiet})


def ray_runner(config: StudyConfig) -> TaskRunner[Any]:
    """Return a runner on the study's Ray cluster, or on a local one of so many processes."""
    from prefect_ray.task_runners import RayTaskRunner

    settings = {"log_to_driver": False, "logging_level": "ERROR"}
    if config.ray_address:
        require_answer(config.ray_address)
    else:
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
        # Task runs pass references: what Ray would keep of the machine's memory for their results is not needed.
        settings |= {
            "num_cpus": config.workers,
            "include_dashboard": False,
            "object_store_memory": RAY_STORE_BYTES,
        }
    runner: TaskRunner[Any] = RayTaskRunner(address=config.ray_address, init_kwargs=settings)
    return runner


def require_answer(address: str) -> None:
    """Raise OSError where nobody listens at tcp://HOST:PORT or HOST:PORT; Ray itself would try for minutes."""
    where = urlsplit(address if "//" in address else f"//{address}")
    if where.port:
        socket.create_connection((where.hostname, where.port), REACH_TIMEOUT_S).close()


def is_transient(task: object, task_run: object, state: Any) -> bool:
    """Say whether trying again can help: a full disk or a busy file may pass, a mistake in the input does not."""
    return isinstance(state.result(raise_on_failure=False), OSError)


def run_all(
    task: Task[..., Any],
    calls: Iterable[tuple[Any, ...]],
    in_flight: int,
    ended: Ended | None = None,
    *,
    runner: AbstractContextManager[TaskRunner[Any]] | None = None,
) -> None:
    """Run a task once for each call's arguments, at most `in_flight` at once; `ended` is told each result as it comes.

    `runner` says where, in threads of this process by default. Raises the first PlancurateError among the task runs as
    it is, or IncompleteError that counts all failures: a flow that returns a value counts as completed whatever became
    of its task runs, so this looks at each.
    """
    over: SimpleQueue[PrefectFuture[Any]] = SimpleQueue()
    under_way: dict[UUID, int] = {}
    # Of a run that succeeds nothing is kept: each future holds all that Prefect knows of its run.
    errors: dict[int, BaseException] = {}

    def wait_for_one() -> None:
        future = over.get()
        number, result = under_way.pop(future.task_run_id), future.result(raise_on_failure=False)
        if isinstance(result, BaseException):
            errors[number] = result
        elif ended:
            ended(result)
        _forget(future.task_run_id, result)

    with runner or ThreadPoolTaskRunner() as where:
        count = 0
        for count, call in enumerate(calls, start=1):
            if len(under_way) >= in_flight:
                wait_for_one()
            future = where.submit(task, get_call_parameters(task.fn, call, {}))
            under_way[future.task_run_id] = count
            future.add_done_callback(over.put)
        while under_way:
            wait_for_one()
        _refuse(task.name, [errors[number] for number in sorted(errors)], count)


def _forget(task_run: UUID, result: object) -> None:
    """Let go of what Prefect keeps of a task run to the flow's end, to see which others depend on its result: none."""
    if context := FlowRunContext.get():
        context.run_results.pop(id(result), None)
        context.task_run_assets.pop(task_run, None)


def run_groups(task: Task[..., Any], study: StudyContext, networks: Sequence[Network], ended: Ended) -> None:
    """Run a task for these networks, some of a policy and pool at once: its arguments are study, networks, title."""
    together = groups(study, networks)
    calls = ((reference(study), *call) for call in zip(together, titles(together), strict=True))
    run_all(task, calls, study.config.workers, ended, runner=shared_runner(study.config))


def _refuse(name: str, errors: list[BaseException], runs: int) -> None:
    for error in errors:
        # Prefect's threads keep each to the end of the process, with all that its frames hold.
        traceback.clear_frames(error.__traceback__)
    for error in errors:
        if isinstance(error, PlancurateError):
            raise error
    if errors:
        raise IncompleteError(
            f"{len(errors)} of {runs} '{name}' runs failed, the first with "
            f"{type(errors[0]).__name__}: {errors[0]}; run the same command again to do the rest"
        ) from errors[0]
