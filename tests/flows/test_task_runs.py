"""Many task runs in one flow: each result is told, and nothing of a run is kept once it is known."""

from __future__ import annotations

import gc
from dataclasses import dataclass
from pathlib import Path

import pytest
from prefect import flow, task
from prefect.cache_policies import NO_CACHE
from prefect.context import FlowRunContext
from prefect.futures import PrefectFuture

from plancurate.flows.server.prefect_server import prefect_server
from plancurate.flows.task_runs import run_all
from plancurate.tasks.lake.home import Home

RUNS, IN_FLIGHT = 24, 2


@dataclass(frozen=True)
class Doubled:
    """A result that Prefect can tell from others."""

    number: int


@pytest.mark.server
def test_each_result_is_told_and_nothing_of_a_run_is_kept_after_that(
    shared_server: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PREFECT_API_URL", shared_server)
    told: list[int] = []
    futures: list[int] = []
    states: list[int] = []
    assets: list[int] = []

    @task(cache_policy=NO_CACHE, persist_result=False)
    def double(number: int) -> Doubled:
        return Doubled(2 * number)

    def ended(result: Doubled) -> None:
        told.append(result.number)
        context = FlowRunContext.get()
        assert context is not None
        states.append(len(context.run_results))
        assets.append(len(context.task_run_assets))
        del result
        gc.collect()
        futures.append(sum(issubclass(type(thing), PrefectFuture) for thing in gc.get_objects()))

    @flow
    def doubles() -> None:
        run_all(double, ((number,) for number in range(RUNS)), IN_FLIGHT, ended)

    with prefect_server(Home(tmp_path)):
        doubles()
    assert sorted(told) == [2 * number for number in range(RUNS)]
    assert max(futures) <= IN_FLIGHT + 1
    assert max(states) <= 2 * IN_FLIGHT
    assert max(assets) <= 2 * IN_FLIGHT
