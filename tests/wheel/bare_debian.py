"""The wheel on a Debian that has Python and little else, by somebody who is not root: `make test-wheel` runs this.

That system lies in build/bare with every package in its folder wheels/; `make` makes it. Stepping into it takes root.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

SYSTEM = Path("build/bare").absolute()
HOME = "/home/person"
PERSON = 1000
VARIABLES = {
    "HOME": HOME,
    "PATH": f"{HOME}/venv/bin:/usr/bin:/bin",
    "LANG": "C.UTF-8",
    "OMP_NUM_THREADS": "1",
    "PIP_NO_INDEX": "1",
    "PIP_FIND_LINKS": "/wheels",
    "UV_OFFLINE": "1",
    "UV_FIND_LINKS": "/wheels",
    "LOKY_MAX_CPU_COUNT": "2",  # without /sys joblib can't count
}
# Whoever ends the first process inside ends all of them. That one stays root: the kernel forgets to end with its parent
# a process that becomes somebody else.
INSIDE = [
    "unshare", "--mount", "--pid", "--fork", "--kill-child", "--mount-proc=/proc", f"--root={SYSTEM}",
    f"--wd={HOME}", "sh", "-c", '"$@"; exit', "sh",
    "setpriv", f"--reuid={PERSON}", f"--regid={PERSON}", "--clear-groups", "env", "--ignore-environment",
    *(f"{name}={value}" for name, value in VARIABLES.items()), "sh", "-e", "-c",
]  # fmt: skip
LIBRARIES = "find / -xdev -path /home -prune -o -name 'libompl*' -print -o -name 'libboost*' -print"
LOADED = "import plancurate.native; print(open('/proc/self/maps').read())"
STUDY = "plancurate study --preset smoke"
ONE_NETWORK = f"{STUDY} --name nightly --selectors RuleBased_General --policies BC_MLP --unseen 8"
CHAMPION = "models:/nightly-BC_MLP@champion"
PORT = 5099


def run(script: str) -> str:
    """What a script says that runs inside, all of it."""
    done = subprocess.run(
        [*INSIDE, script], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False
    )
    assert done.returncode == 0, done.stdout
    return done.stdout


@contextmanager
def running(script: str) -> Iterator[subprocess.Popen[str]]:
    """A program inside that ends with the block."""
    process = subprocess.Popen([*INSIDE, script], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        yield process
    finally:
        process.kill()  # and with it, as unshare was asked to, all that it started
        process.communicate()


@pytest.fixture(scope="module", autouse=True)
def installed() -> None:
    """plancurate in a virtual environment of a new person's."""
    shutil.rmtree(SYSTEM / HOME[1:], ignore_errors=True)
    (SYSTEM / HOME[1:]).mkdir(parents=True)
    shutil.chown(SYSTEM / HOME[1:], PERSON, PERSON)
    run("python3 -m venv venv && pip install -q --upgrade pip setuptools && pip install -q plancurate uv")


@pytest.fixture(scope="module")
def studied() -> str:
    """What the smoke study says."""
    return run(STUDY)


def test_the_system_has_neither_ompl_nor_a_compiler() -> None:
    assert not run(f"{LIBRARIES} 2>/dev/null || true; command -v c++ cc cmake || true")


def test_what_is_loaded_is_what_the_wheel_carries() -> None:
    loaded = {line.split()[-1] for line in run(f'python -c "{LOADED}"').splitlines() if ".so" in line}
    carried = {Path(path).name.partition("-")[0] for path in loaded if "/plancurate.libs/" in path}
    assert carried >= {"libompl", "libboost_serialization", "libboost_filesystem"}


def test_each_library_comes_with_its_licence() -> None:
    packages = SYSTEM / HOME[1:] / "venv/lib"
    (licences,) = packages.glob("python3*/site-packages/plancurate-*.dist-info/licenses")
    (libraries,) = packages.glob("python3*/site-packages/plancurate.libs")
    said = {path.parent.name: path.read_text() for path in licences.glob("*/copyright")}
    for library in libraries.iterdir():
        name = library.name.partition("-")[0].replace("_", "-")
        assert any(package.startswith(name) for package in said), library
    assert "Redistribution" in next(text for name, text in said.items() if name.startswith("libompl"))
    assert {"LICENSE", "native"} <= {path.name for path in licences.iterdir()}


def test_the_smoke_study_runs(studied: str) -> None:
    assert "2 training targets, 36 networks tested" in studied
    assert "Success in percent" in studied
    assert "Traceback" not in studied
    assert "Warning" not in studied


def test_serve_works_in_an_empty_folder() -> None:
    with running("mkdir served && cd served && plancurate serve") as process:
        said = ""
        while "Ctrl-C" not in said and (line := process.stdout.readline()):
            said += line
        (prefect, *_) = re.findall(r"http://127\.0\.0\.1:\d+", said)
        form = json.dumps({"preset": "smoke", "n_targets": 1, "planners": ["RRTConnect"]})
        asked = f"prefect deployment run generate/generate --watch --param config='{form}'"
        ran = run(f"PREFECT_API_URL={prefect}/api {asked}")
        assert "Flow run finished successfully" in ran


def test_mlflow_serves_a_champion_from_an_environment_of_its_own(studied: str) -> None:
    assert "first champions: nightly-BC_MLP" in run(ONE_NETWORK)
    serve = f"mlflow models serve -m {CHAMPION} --env-manager uv --port {PORT}"
    with running(f"MLFLOW_TRACKING_URI=sqlite:///{HOME}/data/mlflow.db {serve}") as process:
        answered(process, f"http://127.0.0.1:{PORT}/ping")
        question = {"inputs": [[0.9, 0.1, 0.6]]}
        (answer,) = answered(process, f"http://127.0.0.1:{PORT}/invocations", question)["predictions"]
    assert answer["verdict"]["passed"], answer["refused"]


def answered(process: subprocess.Popen[str], url: str, question: Any = None) -> Any:
    """The answer of a server that may still be starting; an assertion when it ends or takes ten minutes."""
    data = None if question is None else json.dumps(question).encode()
    request = urllib.request.Request(url, data, {"Content-Type": "application/json"})
    deadline = time.monotonic() + 600
    while time.monotonic() < deadline:
        assert process.poll() is None, process.stdout.read()
        try:
            with urllib.request.urlopen(request) as response:
                return json.loads(response.read().strip() or b"null")
        except urllib.error.HTTPError as error:
            raise AssertionError(error.read().decode()) from error
        except urllib.error.URLError:
            time.sleep(0.5)
    raise AssertionError(f"{url} does not answer")
