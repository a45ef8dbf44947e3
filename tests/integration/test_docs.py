"""Every command and every Python example of the README and docs/ runs as it is written."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from plancurate.tasks.exports.formats import write_export
from plancurate.tasks.lake.home import Home
from plancurate.tasks.study.exported import exported_episodes

from ..homes import environment
from .conftest import Command, Studied

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks(kind: str) -> list[tuple[str, str]]:
    return [
        (page.name, text)
        for page in PAGES
        for found, text in BLOCK.findall(page.read_text())
        if found == kind
    ]


COMMANDS = sorted(
    {
        line.removeprefix("$ ")
        for _, text in blocks("console")
        for line in text.splitlines()
        if line.startswith("$ plancurate")
    }
)
MAKE = {
    line.removeprefix("$ ") for _, text in blocks("console") for line in text.splitlines() if "$ make" in line
}


@pytest.fixture(scope="module")
def home(smoke: Studied, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the smoke study that the examples may add to."""
    copy = tmp_path_factory.mktemp("docs") / "home"
    shutil.copytree(smoke.untouched, copy)
    return copy


@pytest.fixture(scope="module")
def exported(home: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A set of joint trajectories, as somebody may have one from elsewhere."""
    folder = tmp_path_factory.mktemp("exported") / "lerobot"
    write_export(exported_episodes(Home(home), ["General"]), "lerobot", folder)
    return folder


def test_the_pages_hold_commands_and_examples() -> None:
    assert len(COMMANDS) >= 10
    assert len(blocks("python")) >= 4


@pytest.mark.parametrize("command", COMMANDS)
def test_a_documented_command_runs(
    command: str, home: Path, exported: Path, tmp_path: Path, plancurate_on_shared_server: Command
) -> None:
    (tmp_path / "docs").symlink_to(ROOT / "docs")  # some pages name a file beside them
    (tmp_path / "from_lerobot").symlink_to(exported)
    words = shlex.split(command, comments=True)[1:]
    done = plancurate_on_shared_server(*words, folder=tmp_path, PLANCURATE_HOME=str(home))
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(("page", "example"), blocks("python"))
def test_a_documented_example_runs(page: str, example: str, home: Path, tmp_path: Path) -> None:
    file = tmp_path / "example.py"
    file.write_text(example)
    done = subprocess.run(
        [sys.executable, str(file)],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env=environment(PLANCURATE_HOME=str(home)),
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, f"{page}: {done.stderr}"


def test_every_make_target_of_the_pages_exists() -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    assert {shlex.split(command, comments=True)[1] for command in MAKE} <= targets
    assert os.access(ROOT / ".ci" / "run", os.X_OK)
