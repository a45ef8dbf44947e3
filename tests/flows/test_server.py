"""The Prefect server of a run: real server processes on 127.0.0.1."""

from __future__ import annotations

import os
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from plancurate.errors import PlancurateError
from plancurate.flows.server.own_server import serving
from plancurate.flows.server.prefect_server import prefect_server
from plancurate.flows.server.services import healthy
from plancurate.tasks.lake.home import Home

from ..homes import NewHome

pytestmark = pytest.mark.server

SHORT = """
import sys
from plancurate.tasks.lake.home import Home
from plancurate.flows.server.prefect_server import prefect_server

with prefect_server(Home.resolve(sys.argv[1])):
    from prefect import flow, task

    @task(retries=1, task_run_name="plan {i}")
    def plan(i):
        if i == 7:
            raise ValueError("seven")

    @flow
    def study():
        return [plan.submit(i) for i in range(150)]

    study(return_state=True)
"""
LONG = """
import sys, time
from plancurate.tasks.lake.home import Home
from plancurate.flows.server.prefect_server import prefect_server

with prefect_server(Home.resolve(sys.argv[1])) as url:
    from prefect import flow

    @flow(flow_run_name="cut off")
    def study():
        print(url, flush=True)
        sys.stdin.read()

    study()
"""


@pytest.fixture(autouse=True)
def unconfigured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("PREFECT_API_URL", raising=False)


@pytest.fixture(scope="module")
def home(new_home: NewHome, tmp_path_factory: pytest.TempPathFactory) -> Home:
    """One home for all tests."""
    return Home(new_home(tmp_path_factory.mktemp("home")))


@pytest.fixture
def user(home: Home) -> Callable[..., subprocess.Popen[str]]:
    """Start a process that uses the home's server."""

    def start(code: str) -> subprocess.Popen[str]:
        command = [sys.executable, "-c", code, str(home.root)]
        pipe = subprocess.PIPE
        return subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.STDOUT, text=True)

    return start


@contextmanager
def ended(process: subprocess.Popen[str]) -> Iterator[None]:
    """Let a user end by itself and release its pipes."""
    try:
        yield
    finally:
        process.communicate(timeout=60)


def flow_runs(home: Home) -> dict[str, str]:
    """State of the latest flow run of each name in the home's database."""
    with sqlite3.connect(home.prefect / "prefect.db") as database:
        return dict(database.execute("SELECT name, state_type FROM flow_run ORDER BY created"))


def goes_away(url: str, seconds: float) -> bool:
    """Whether the server at a URL stops answering within so many seconds."""
    deadline = time.monotonic() + seconds
    while healthy(url) and time.monotonic() < deadline:
        time.sleep(0.1)
    return not healthy(url)


def test_every_executed_task_run_is_recorded_and_nothing_is_printed(
    home: Home, user: Callable[..., subprocess.Popen[str]]
) -> None:
    done = user(SHORT)
    said, _ = done.communicate(timeout=120)
    assert (done.returncode, said) == (0, "")
    with sqlite3.connect(home.prefect / "prefect.db") as database:
        states = dict(database.execute("SELECT state_type, count(*) FROM task_run GROUP BY 1"))
    assert states == {"COMPLETED": 149, "FAILED": 1}


def test_two_runs_share_a_server_and_the_last_one_ends_it(
    home: Home, user: Callable[..., subprocess.Popen[str]]
) -> None:
    other = user(LONG)
    with ended(other):
        theirs = other.stdout.readline().strip()
        with prefect_server(home) as ours:
            assert ours == theirs
        assert healthy(theirs)
    assert other.returncode == 0
    assert not healthy(theirs)


def test_a_killed_run_takes_its_server_with_it_and_is_marked_as_crashed(
    home: Home, user: Callable[..., subprocess.Popen[str]]
) -> None:
    killed = user(LONG)
    with ended(killed):
        url = killed.stdout.readline().strip()
        killed.send_signal(signal.SIGKILL)
    assert goes_away(url, seconds=20)
    assert flow_runs(home)["cut off"] == "RUNNING"
    with prefect_server(home):
        assert flow_runs(home)["cut off"] == "CRASHED"


def test_what_goes_wrong_while_the_server_starts_is_raised_and_ends_it(home: Home) -> None:
    def fail() -> None:
        while not serving(home):
            time.sleep(0.05)
        raise PlancurateError("no such robot")

    with pytest.raises(PlancurateError, match="no such robot"), prefect_server(home, meanwhile=fail):
        pass
    assert serving(home) is None


def test_the_server_is_configured_while_it_is_used_and_not_afterwards(home: Home) -> None:
    from prefect.settings import PREFECT_API_URL

    before = dict(os.environ)
    with prefect_server(home) as url:
        assert PREFECT_API_URL.value() == url
        with prefect_server(Home(home.root / "unused")) as used:  # as if a user had configured it
            assert used == url
    assert dict(os.environ) == before
    assert PREFECT_API_URL.value() is None
    assert not (home.root / "unused").exists()


@pytest.mark.parametrize(
    ("file", "text"),
    [
        (".env", "PREFECT_API_URL={}"),
        ("prefect.toml", '[api]\nurl = "{}"'),
        ("pyproject.toml", '[tool.prefect.api]\nurl = "{}"'),
        ("profiles.toml", 'active = "mine"\n[profiles.mine]\nPREFECT_API_URL = "{}"'),
    ],
)
def test_a_server_configured_in_a_file_is_not_replaced_by_our_own(
    file: str, text: str, tmp_path: Path
) -> None:
    (tmp_path / file).write_text(text.format("http://127.0.0.1:9/api"))
    kept = {name: value for name, value in os.environ.items() if not name.startswith("PREFECT_")}
    paths = os.pathsep.join(str(Path(path).absolute()) for path in sys.path if path)
    done = subprocess.run(
        [sys.executable, "-c", SHORT, "home"],
        cwd=tmp_path,
        env=kept | {"PYTHONPATH": paths, "PREFECT_HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert "http://127.0.0.1:9/api: no Prefect API answers there" in done.stderr
    assert not (tmp_path / "home").exists()


def test_a_configured_server_that_does_not_answer_is_said_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PREFECT_API_URL", "http://127.0.0.1:9/api")
    complaint = pytest.raises(
        PlancurateError, match=r"PREFECT_API_URL=http://127\.0\.0\.1:9/api: no Prefect API"
    )
    with complaint, prefect_server(Home(tmp_path / "home")):
        pass
    assert not list(tmp_path.iterdir())


def test_a_server_that_can_not_start_is_said_in_one_line(tmp_path: Path, expected_in_logs: list[str]) -> None:
    expected_in_logs.append("unable to open database file")
    home = Home(tmp_path)
    (home.prefect / "prefect.db").mkdir(parents=True)
    complaint = pytest.raises(PlancurateError, match=r"server\.log: the Prefect server did not start")
    with complaint as caught, prefect_server(home):
        pass
    assert "\n" not in str(caught.value)
