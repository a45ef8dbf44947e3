"""Ctrl-C while a task run is at what can't be interrupted."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time

import pytest

from plancurate.flows.cli.stopping import GRACE_S, INTERRUPTED, ends_on_ctrl_c

from ..homes import environment

AT_WORK = """
import time
import plancurate.flows.cli.app as command_line
from prefect import flow, task

@task
def train():
    print("at work", flush=True)
    time.sleep(60)  # in a thread no signal ends it

@flow
def study():
    from plancurate.flows.task_runs import run_all
    run_all(train, [()], 1)

command_line.app = lambda *_, **__: study()
command_line.main([])
"""
SOON_S = GRACE_S + 7


def run_until_at_work(server: str) -> subprocess.Popen[str]:
    variables = environment(PREFECT_API_URL=server)
    pipe = subprocess.PIPE
    run = subprocess.Popen(
        [sys.executable, "-c", AT_WORK], env=variables, stdout=pipe, stderr=pipe, text=True
    )
    assert run.stdout is not None
    assert run.stdout.readline() == "at work\n"
    return run


@pytest.mark.parametrize("times", [1, 2])
def test_ctrl_c_ends_a_command_within_seconds_and_with_one_line(shared_server: str, times: int) -> None:
    run = run_until_at_work(shared_server)
    try:
        asked = time.monotonic()
        for _ in range(times):
            run.send_signal(signal.SIGINT)
            time.sleep(0.5)
        _, said = run.communicate(timeout=50)
    finally:
        run.kill()
    assert run.returncode == INTERRUPTED
    assert time.monotonic() - asked < (SOON_S if times == 1 else GRACE_S)
    lines = [line for line in said.splitlines() if line.startswith("plancurate: ")]
    assert lines == ["plancurate: stopped; the same command goes on from here"]


def test_where_ctrl_c_is_ignored_or_not_ours_it_stays_so() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with ends_on_ctrl_c():
            assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)
    with ends_on_ctrl_c():
        assert signal.getsignal(signal.SIGINT) is not before
    assert signal.getsignal(signal.SIGINT) is before


def test_in_a_thread_nothing_is_changed() -> None:
    seen: list[object] = []

    def run() -> None:
        with ends_on_ctrl_c():
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    assert seen == [signal.default_int_handler]
