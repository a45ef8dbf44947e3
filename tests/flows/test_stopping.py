"""Ctrl-C and `kill` while a task run is at what can't be interrupted."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from typing import Any

import pytest

from plancurate.flows.cli.stopping import GRACE_S, ends_on_ctrl_c

from ..homes import environment

AT_WORK = """
import signal, time
from pathlib import Path
signal.signal(signal.SIGINT, signal.default_int_handler)  # what runs the tests may have been told to ignore it
import plancurate.flows.cli.app as command_line
from plancurate.flows.cli.stages import run_flow
from plancurate.tasks.lake.home import Home
from prefect import flow, task

@task
def train():
    print("at work", flush=True)
    time.sleep(60)  # in a thread no signal ends it

@flow
def study():
    from plancurate.flows.task_runs import run_all
    run_all(train, [()], 1)

command_line.app = lambda *_, **__: run_flow(lambda *_, **__: study(), None, Home(Path("nowhere")))
command_line.main([])
"""
SOON_S = GRACE_S + 7


@pytest.mark.parametrize(
    ("told", "times", "code"), [(signal.SIGINT, 1, 130), (signal.SIGINT, 2, 130), (signal.SIGTERM, 1, 143)]
)
def test_a_command_that_is_told_to_stop_ends_within_seconds_and_with_one_line(
    shared_server: str, told: signal.Signals, times: int, code: int
) -> None:
    command, pipe = [sys.executable, "-c", AT_WORK], subprocess.PIPE
    variables = environment(PREFECT_API_URL=shared_server)
    with subprocess.Popen(command, env=variables, stdout=pipe, stderr=pipe, text=True) as run:
        try:
            assert run.stdout is not None
            assert run.stdout.readline() == "at work\n"
            asked = time.monotonic()
            for _ in range(times):
                run.send_signal(told)
                time.sleep(0.5)
            _, said = run.communicate(timeout=50)
        finally:
            run.kill()
    assert run.returncode == code
    assert time.monotonic() - asked < (SOON_S if times == 1 else GRACE_S)
    lines = [line for line in said.splitlines() if line.startswith("plancurate: ")]
    assert lines == ["plancurate: stopped; the same command goes on from here"]


@pytest.fixture
def handler() -> Iterator[Any]:
    """Python's own answer to Ctrl-C, which what runs the tests may have been told to ignore."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield signal.default_int_handler
    signal.signal(signal.SIGINT, before)


def test_ctrl_c_is_ours_as_long_as_it_lasts(handler: Any) -> None:
    with ends_on_ctrl_c():
        assert signal.getsignal(signal.SIGINT) is not handler
    assert signal.getsignal(signal.SIGINT) is handler


def test_where_ctrl_c_is_ignored_it_stays_so(handler: Any) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with ends_on_ctrl_c():
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN


def test_in_a_thread_nothing_is_changed(handler: Any) -> None:
    seen: list[object] = []

    def run() -> None:
        with ends_on_ctrl_c():
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    assert seen == [handler]
