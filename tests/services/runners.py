"""A study gives the same rows wherever its task runs work, and whoever works beside it."""

from __future__ import annotations

from pathlib import Path

import pytest

from ..homes import NewHome
from ..integration.commands import Commands
from ..integration.conftest import Command
from ..integration.test_resume import assert_sound
from .tiny_study import Rows, rows, rows_of_a_run, words


@pytest.mark.parametrize("runner", ["processes", "dask"])
def test_a_study_writes_the_same_rows_on_every_runner(
    plancurate_on_shared_server: Command,
    on_threads: Rows,
    new_home: NewHome,
    tmp_path: Path,
    runner: str,
) -> None:
    assert all(on_threads)
    assert rows_of_a_run(plancurate_on_shared_server, new_home(tmp_path), runner) == on_threads


def test_studies_at_once_in_a_home_write_what_each_writes_alone(
    commands: Commands, shared_server: str, on_threads: Rows, new_home: NewHome, tmp_path: Path
) -> None:
    home = new_home(tmp_path / "home")
    started = [
        commands.start(*words(home, name, "threads"), PREFECT_API_URL=shared_server)
        for name in ("tiny", "other")
    ]
    for one in started:
        done = one.result()
        assert done.returncode == 0, done.stderr
    assert rows(home, "tiny") == rows(home, "other") == on_threads
    assert_sound(home)
