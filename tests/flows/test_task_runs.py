"""Many task runs in one flow: results in order, and nothing of a run is kept once its result is known."""

from __future__ import annotations

import gc
from pathlib import Path

import pytest
from prefect import flow, task
from prefect.cache_policies import NO_CACHE
from prefect.futures import PrefectFuture

from plancurate.flows.server.prefect_server import prefect_server
from plancurate.flows.task_runs import run_all
from plancurate.tasks.lake.home import Home

RUNS, IN_FLIGHT = 12, 2


@pytest.mark.server
def test_results_come_in_order_and_futures_go_with_their_runs(
    shared_server: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PREFECT_API_URL", shared_server)
    held = []

    @task(cache_policy=NO_CACHE, persist_result=False)
    def double(number: int) -> int:
        return 2 * number

    def ended(_: int) -> None:
        gc.collect()
        held.append(sum(issubclass(type(thing), PrefectFuture) for thing in gc.get_objects()))

    @flow
    def doubles() -> list[int]:
        return run_all(double, ((number,) for number in range(RUNS)), IN_FLIGHT, ended)

    with prefect_server(Home(tmp_path)):
        assert doubles() == [2 * number for number in range(RUNS)]
    assert max(held) <= IN_FLIGHT + 1
