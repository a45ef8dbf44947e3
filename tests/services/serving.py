"""`plancurate serve`: the real services, a deployment run by a real worker, by hand and by its schedule."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from prefect.exceptions import PrefectHTTPStatusError

from plancurate.flows.server.deployments import deploy
from plancurate.flows.server.services import healthy
from plancurate.locks import read_note
from plancurate.tasks.lake.home import Home
from plancurate.tasks.lake.store import Lake

from ..browser import CHROMIUM, browser
from ..homes import NewHome, environment
from .walk import HEIGHT, WIDTH, compare, start, watch_run

pytestmark = pytest.mark.server

DOCS = Path(__file__).parents[2] / "docs"
RUN_TIMEOUT_S = 600
FINAL = {"COMPLETED", "FAILED", "CRASHED", "CANCELLED"}
ONE_TARGET = {"config": {"name": "served", "n_targets": 1, "planners": ["RRTConnect"]}}


@dataclass
class Serving:
    """A `plancurate serve` that is ready."""

    process: subprocess.Popen[str]
    home: Home
    prefect: str
    mlflow: str


def serve(home: Home) -> subprocess.Popen[str]:
    """Serve a home from a folder that is not the repository."""
    paths = os.pathsep.join(str(Path(path).absolute()) for path in sys.path if path)
    words = ["from plancurate.flows.cli.app import main; main()", "serve", "--home", str(home.root)]
    command = [sys.executable, "-c", *words]
    return subprocess.Popen(
        command, cwd=home.root, env=environment(PYTHONPATH=paths), stderr=subprocess.PIPE, text=True
    )


def ready(home: Home) -> Serving:
    """Serve a home and wait until everything answers."""
    process = serve(home)
    said = ""
    while "Ctrl-C" not in said and (line := process.stderr.readline()):
        said += line
    note = read_note(home.prefect / "serve.lock")
    assert note is not None, said
    assert (note["pid"], note["prefect"] in said, note["mlflow"] in said) == (process.pid, True, True)
    return Serving(process, home, note["prefect"], note["mlflow"])


@contextmanager
def served(home: Home) -> Iterator[Serving]:
    """A home that is served until it is killed."""
    services = ready(home)
    try:
        yield services
    finally:
        services.process.kill()
        services.process.communicate()


@pytest.fixture(scope="module")
def home(new_home: NewHome, tmp_path_factory: pytest.TempPathFactory) -> Home:
    return Home(new_home(tmp_path_factory.mktemp("served")))


@pytest.fixture(scope="module")
def serving(home: Home) -> Iterator[Serving]:
    """The services that the tests share: they take longer to start than all that is asked of them."""
    with served(home) as services:
        yield services


@pytest.fixture
def restarted(home: Home) -> Iterator[Serving]:
    """The same home, served again after the process before it was killed."""
    with served(home) as services:
        yield services


def request(serving: Serving, method: str, path: str, body: Any = None) -> Any:
    from prefect.client.orchestration import SyncPrefectClient

    with SyncPrefectClient(f"{serving.prefect}/api") as client:
        answer = client._client.request(method, path, json=body)
        return answer.json() if answer.content else None


def events(serving: Serving, prefix: str) -> list[dict[str, Any]]:
    """What Prefect's event feed shows of events whose names begin so."""
    asked = {"filter": {"event": {"prefix": [prefix]}}}
    return list(request(serving, "POST", "/events/filter", asked)["events"])


def ended(serving: Serving, run_id: str, state: str = "COMPLETED") -> dict[str, Any]:
    """Wait for a flow run, which must end in this state."""
    run: dict[str, Any] = {"state_type": "SCHEDULED"}
    deadline = time.monotonic() + RUN_TIMEOUT_S
    while run["state_type"] not in FINAL and time.monotonic() < deadline:
        time.sleep(0.5)
        run = request(serving, "GET", f"/flow_runs/{run_id}")
    assert run["state_type"] == state, (serving.home.prefect / "worker.log").read_text()
    return run


def processes(home: Home) -> list[str]:
    """Command lines of the processes that work on a home, where the system lists them as files."""
    lines = []
    for file in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):  # it has just ended
            lines.append(file.read_text())
    return [line for line in lines if str(home.root) in line]


def all_gone(home: Home, seconds: float) -> bool:
    """Whether no process works on a home within so many seconds."""
    return true_within(seconds, lambda: not processes(home))


def true_within(seconds: float, condition: Callable[[], bool]) -> bool:
    """Whether something becomes true within so many seconds."""
    deadline = time.monotonic() + seconds
    while not (true := condition()) and time.monotonic() < deadline:
        time.sleep(0.1)
    return true


def test_every_deployment_has_a_description_a_form_and_a_limit(serving: Serving) -> None:
    deployments = {item["name"]: item for item in request(serving, "POST", "/deployments/filter", {})}
    assert len(deployments) == 9
    for name, deployment in deployments.items():
        assert deployment["description"]
        assert set(deployment["tags"]) == {"plancurate", name}
        assert deployment["enforce_parameter_schema"]
        assert ("targets" if name == "predict" else "n_targets") in str(
            deployment["parameter_openapi_schema"]
        )
        assert deployment["global_concurrency_limit"]["limit"] == 1
        assert deployment["work_pool_name"] == "plancurate"
    (nightly,) = deployments["study"]["schedules"]
    assert (nightly["schedule"]["cron"], nightly["active"]) == ("0 2 * * *", False)
    assert nightly["parameters"] == {"grow": 5}


def test_wrong_input_is_refused_before_anything_runs(serving: Serving) -> None:
    study = request(serving, "GET", "/deployments/name/study/study")["id"]
    wrong = {"parameters": {"config": {"policies": ["BC_CNN"]}}}
    with pytest.raises(PrefectHTTPStatusError, match=r"config\.policies\[0\].*'BC_CNN' is not one of"):
        request(serving, "POST", f"/deployments/{study}/create_flow_run", wrong)


def test_a_deployment_runs_through_the_worker_and_fills_the_served_home(serving: Serving) -> None:
    generate = request(serving, "GET", "/deployments/name/generate/generate")["id"]
    run = request(serving, "POST", f"/deployments/{generate}/create_flow_run", {"parameters": ONE_TARGET})
    assert ended(serving, run["id"])["name"] == "generate served"
    rows = Lake(serving.home.lake).connect().sql("SELECT DISTINCT planner FROM trajectories").fetchall()
    assert rows == [("RRTConnect",)]
    assert true_within(30, lambda: bool(events(serving, "plancurate.pool")))
    (event,) = events(serving, "plancurate.pool")
    assert event["event"] == "plancurate.pool.ready"
    assert event["resource"]["prefect.resource.name"] == "scene free"
    assert event["payload"]["targets"] == 1
    assert 0 < event["payload"]["distinct"] <= event["payload"]["candidates"] == 3
    assert run["id"] in str(event["related"])


def test_a_cancelled_run_ends_and_the_next_one_goes_on(serving: Serving) -> None:
    generate = request(serving, "GET", "/deployments/name/generate/generate")["id"]
    config = {"name": "cancelled", "n_targets": 300, "planners": ["PRM"]}

    def start(**changes: Any) -> str:
        parameters = {"config": config | changes}
        body = {"parameters": parameters}
        return str(request(serving, "POST", f"/deployments/{generate}/create_flow_run", body)["id"])

    def made() -> dict[str, bytes]:
        return {path.name: path.read_bytes() for path in serving.home.lake.rglob("planner=PRM/part-*")}

    run = start()
    assert true_within(120, lambda: len(made()) > 1)
    request(serving, "POST", f"/flow_runs/{run}/set_state", {"state": {"type": "CANCELLING"}})
    ended(serving, run, "CANCELLED")
    kept = made()
    ended(serving, start(n_targets=1))
    assert made() == kept
    assert Lake(serving.home.lake).damage() == []


def test_a_schedule_of_a_minute_starts_a_run_that_completes(serving: Serving) -> None:
    generate = request(serving, "GET", "/deployments/name/generate/generate")["id"]
    first = datetime.now(UTC) + timedelta(seconds=15)
    minute = {"interval": 60, "anchor_date": first.isoformat()}
    plan = [{"schedule": minute, "active": True, "parameters": ONE_TARGET}]
    (schedule,) = request(serving, "POST", f"/deployments/{generate}/schedules", plan)
    by_schedule = {
        "flow_runs": {"deployment_id": {"any_": [generate]}, "state": {"type": {"any_": ["SCHEDULED"]}}}
    }
    planned: list[dict[str, Any]] = []
    deadline = time.monotonic() + 100
    while not planned and time.monotonic() < deadline:
        time.sleep(0.5)
        planned = request(
            serving, "POST", "/flow_runs/filter", by_schedule | {"sort": "EXPECTED_START_TIME_ASC"}
        )
    assert planned, (serving.home.prefect / "server.log").read_text()
    run = ended(serving, planned[0]["id"])
    request(serving, "DELETE", f"/deployments/{generate}/schedules/{schedule['id']}")
    assert run["auto_scheduled"]
    assert (run["created_by"]["type"], run["created_by"]["id"]) == ("SCHEDULE", schedule["id"])
    began, expected = (datetime.fromisoformat(run[f"{name}start_time"]) for name in ("", "expected_"))
    assert abs(began - expected) < timedelta(seconds=45)  # a worker may take a run up moments early


def automation(serving: Serving) -> dict[str, Any]:
    (found,) = request(serving, "POST", "/automations/filter", {})
    return dict(found)


def switch(serving: Serving, enabled: bool) -> None:
    """Switch the automation on or off, as its toggle does."""
    request(serving, "PATCH", f"/automations/{automation(serving)['id']}", {"enabled": enabled})


def test_what_was_switched_on_stays_on(serving: Serving, monkeypatch: pytest.MonkeyPatch) -> None:
    from prefect.client.orchestration import SyncPrefectClient
    from prefect.settings import temporary_settings

    study = request(serving, "GET", "/deployments/name/study/study")
    (nightly,) = study["schedules"]
    assert not automation(serving)["enabled"]
    switch(serving, True)
    with SyncPrefectClient(f"{serving.prefect}/api") as client:
        client.update_deployment_schedule(study["id"], nightly["id"], active=True)
    monkeypatch.setenv("PREFECT_API_URL", f"{serving.prefect}/api")
    with temporary_settings({"api.url": f"{serving.prefect}/api"}):
        deploy(serving.home.prefect / "deploy.log")
    (nightly,) = request(serving, "GET", "/deployments/name/study/study")["schedules"]
    assert nightly["active"]
    assert automation(serving)["enabled"]


def test_the_automation_curates_what_generate_has_planned(serving: Serving) -> None:
    switch(serving, True)
    deployments = {
        name: request(serving, "GET", f"/deployments/name/{name}/{name}") for name in ("generate", "curate")
    }
    body = {"parameters": ONE_TARGET}
    planned = request(serving, "POST", f"/deployments/{deployments['generate']['id']}/create_flow_run", body)
    ended(serving, planned["id"])
    of_curate = {"flow_runs": {"deployment_id": {"any_": [deployments["curate"]["id"]]}}}
    assert true_within(60, lambda: bool(request(serving, "POST", "/flow_runs/filter", of_curate)))
    switch(serving, False)
    (run,) = request(serving, "POST", "/flow_runs/filter", of_curate)
    assert run["parameters"] == ONE_TARGET
    assert ended(serving, run["id"])["name"] == "curate served"


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed")
def test_a_study_is_started_watched_and_compared_in_a_browser(serving: Serving, tmp_path: Path) -> None:
    pictures = Path(os.environ.get("SCREENSHOTS", tmp_path)).absolute()
    studies = {"deployments": {"name": {"any_": ["study"]}}}
    with browser(tmp_path / "browser", WIDTH, HEIGHT) as page:
        start(page, serving.prefect, pictures)
        page.open("about:blank")  # a page that shows a run at work keeps a core busy
        found = request(serving, "POST", "/flow_runs/filter", studies)
        (run,) = [run for run in found if not run["auto_scheduled"]]  # the nightly schedule has its own
        ended(serving, run["id"])
        watch_run(page, serving.prefect, pictures)
        compare(page, serving.mlflow, pictures)
    (published,) = events(serving, "plancurate.study")
    assert published["resource"]["prefect.resource.name"].startswith("first-")
    assert published["payload"]["verdict"]
    documented = DOCS / "operations"
    assert {file.name for file in documented.iterdir()} == {
        "form.png",
        "run.png",
        "results.png",
        "mlflow.png",
    }
    for file in (*documented.iterdir(), *pictures.glob("*.png")):
        assert file.stat().st_size < 100_000


def test_mlflow_answers(serving: Serving) -> None:
    assert healthy(serving.mlflow)


def test_serving_a_second_time_says_who_serves_where(serving: Serving) -> None:
    second = serve(serving.home)
    said = second.communicate(timeout=60)[1]
    assert second.returncode == 0
    assert said == (
        f"{serving.home.root} is served already by process {serving.process.pid}: "
        f"Prefect {serving.prefect}, MLflow {serving.mlflow}\n"
    )


def test_killed_services_end_and_start_again(serving: Serving) -> None:
    serving.process.kill()
    assert all_gone(serving.home, seconds=30)


def test_a_killed_prefect_server_is_said_and_ends_everything(
    restarted: Serving, expected_in_logs: list[str]
) -> None:
    os.kill(read_note(restarted.home.prefect / "server.lock")["pid"], signal.SIGKILL)
    said = restarted.process.communicate(timeout=60)[1]
    assert restarted.process.returncode == 2
    assert "server.log: this service ended by itself" in said
    assert len(said.splitlines()) == 1
    assert all_gone(restarted.home, seconds=30)


def test_ctrl_c_stops_everything(restarted: Serving) -> None:
    time.sleep(1.0)  # a signal while Rich prints makes it print the same once more
    restarted.process.send_signal(signal.SIGINT)
    said = restarted.process.communicate(timeout=60)[1]
    assert (restarted.process.returncode, said) == (0, "stopped\n")
    assert not healthy(f"{restarted.prefect}/api")
    assert not healthy(restarted.mlflow)
    assert not processes(restarted.home)
