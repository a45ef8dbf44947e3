"""A run whose Prefect server is killed: it says so in one line and ends."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from plancurate.flows.server.own_server import serving
from plancurate.tasks.lake.home import Home

from ..homes import NewHome, environment

pytestmark = pytest.mark.server

PROMISED_S = 30  # docs/reliability.md
AT_WORK = """
import sys
from plancurate.tasks.lake.home import Home
from plancurate.flows.server.prefect_server import prefect_server
from plancurate.flows.server.server_loss import ends_with_server

home = Home.resolve(sys.argv[1])
with prefect_server(home) as url, ends_with_server(home, url):
    from prefect import flow, task

    @task
    def plan():
        print("at work", flush=True)

    @flow
    def study():
        while True:
            plan()

    study()
"""


def test_a_run_whose_server_is_killed_ends_with_one_line(new_home: NewHome, tmp_path: Path) -> None:
    home = Home(new_home(tmp_path / "home"))
    command = [sys.executable, "-c", AT_WORK, str(home.root)]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, env=environment(), stdout=pipe, stderr=pipe, text=True) as run:
        try:
            assert run.stdout is not None
            assert run.stdout.readline() == "at work\n"
            server = serving(home)
            assert server is not None
            os.killpg(server[0], signal.SIGKILL)
            _, said = run.communicate(timeout=PROMISED_S)
        finally:
            run.kill()
    lines = [line for line in said.splitlines() if line.startswith("plancurate: ")]
    assert run.returncode == 1
    assert len(lines) == 1, said
    assert "the Prefect server of this run ended" in lines[0]
    assert "goes on from here" in lines[0]
