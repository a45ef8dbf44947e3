"""`make serve`: the real services, and a deployment run by a real worker."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from prefect.client.orchestration import SyncPrefectClient
from prefect.settings import temporary_settings

from plancurate.flows.server.serve import deploy, main
from plancurate.flows.server.services import healthy
from plancurate.tasks.lake.home import Home
from plancurate.tasks.lake.store import Lake

ROOT = Path(__file__).parents[2]
FINAL = {"COMPLETED", "FAILED", "CRASHED", "CANCELLED"}


@dataclass
class Serving:
    """A `make serve` that is ready."""

    process: subprocess.Popen[str]
    home: Home
    prefect: str
    mlflow: str


@pytest.fixture(scope="module")
def serving(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Serving]:
    home = Home(tmp_path_factory.mktemp("served"))
    command = [sys.executable, "-m", "plancurate.flows.server.serve", "--home", str(home.root)]
    kept = {
        name: value
        for name, value in os.environ.items()
        if name not in ("PREFECT_API_URL", "MLFLOW_TRACKING_URI")
    }
    kept["PYTHONPATH"] = os.pathsep.join(path for path in sys.path if path)
    process = subprocess.Popen(command, cwd=ROOT, env=kept, stderr=subprocess.PIPE, text=True)
    said = ""
    while "Ctrl-C" not in said and (line := process.stderr.readline()):
        said += line
    addresses = re.findall(r"http://127\.0\.0\.1:\d+", said)
    assert len(addresses) == 2, said
    try:
        yield Serving(process, home, *addresses)
    finally:
        process.kill()
        process.communicate()


def request(serving: Serving, method: str, path: str, **body: Any) -> Any:
    with SyncPrefectClient(f"{serving.prefect}/api") as client:
        return client._client.request(method, path, json=body or None).json()


def commands() -> Iterator[str]:
    """Command lines of all processes, where the system lists them as files."""
    for file in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):  # it has just ended
            yield file.read_text()


def test_every_deployment_has_a_description_a_form_and_a_limit(serving: Serving) -> None:
    deployments = {item["name"]: item for item in request(serving, "POST", "/deployments/filter")}
    assert set(deployments) == {"study", "generate", "curate", "train"}
    for name, deployment in deployments.items():
        assert deployment["description"]
        assert set(deployment["tags"]) == {"plancurate", name}
        assert deployment["enforce_parameter_schema"]
        assert "n_targets" in str(deployment["parameter_openapi_schema"])
        assert deployment["global_concurrency_limit"]["limit"] == 1
        assert deployment["work_pool_name"] == "plancurate"
    (nightly,) = deployments["study"]["schedules"]
    assert (nightly["schedule"]["cron"], nightly["active"]) == ("0 2 * * *", False)


def test_a_deployment_runs_through_the_worker_and_fills_the_served_home(serving: Serving) -> None:
    deployment = request(serving, "GET", "/deployments/name/generate/generate")
    config = {"name": "served", "n_targets": 1, "planners": ["RRTConnect"]}
    run = request(
        serving, "POST", f"/deployments/{deployment['id']}/create_flow_run", parameters={"config": config}
    )
    deadline = time.monotonic() + 120
    while run["state_type"] not in FINAL and time.monotonic() < deadline:
        time.sleep(0.5)
        run = request(serving, "GET", f"/flow_runs/{run['id']}")
    log = (serving.home.prefect / "worker.log").read_text()
    assert run["state_type"] == "COMPLETED", log
    assert run["name"] == "generate served"
    rows = Lake(serving.home.lake).connect().sql("SELECT DISTINCT planner FROM trajectories").fetchall()
    assert rows == [("RRTConnect",)]


def test_a_schedule_that_was_switched_on_stays_on(serving: Serving, monkeypatch: pytest.MonkeyPatch) -> None:
    study = request(serving, "GET", "/deployments/name/study/study")
    (nightly,) = study["schedules"]
    with SyncPrefectClient(f"{serving.prefect}/api") as client:
        client.update_deployment_schedule(study["id"], nightly["id"], active=True)
    monkeypatch.setenv("PREFECT_API_URL", f"{serving.prefect}/api")
    with temporary_settings({"api.url": f"{serving.prefect}/api"}):
        deploy(serving.home, ROOT)
    (nightly,) = request(serving, "GET", "/deployments/name/study/study")["schedules"]
    assert nightly["active"]


def test_mlflow_answers(serving: Serving) -> None:
    assert healthy(serving.mlflow)


def test_ctrl_c_stops_everything(serving: Serving) -> None:
    serving.process.send_signal(signal.SIGINT)
    said = serving.process.communicate(timeout=60)[1]
    assert serving.process.returncode == 0
    assert said.strip().endswith("stopped")
    assert not healthy(f"{serving.prefect}/api")
    assert not healthy(serving.mlflow)
    here = str(serving.home.root)
    commands = (
        [path.read_text() for path in Path("/proc").glob("[0-9]*/cmdline")] if Path("/proc").exists() else []
    )
    assert not [command for command in commands if here in command]


def test_serving_elsewhere_than_in_the_repository_is_said_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["--home", str(tmp_path / "home")]) == 2
    assert "prefect.yaml: no such file" in capsys.readouterr().err
    assert not (tmp_path / "home").exists()
