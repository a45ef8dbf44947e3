"""A study on a cluster with its lake in an S3-compatible store has the rows of one on threads with files."""

from __future__ import annotations

from pathlib import Path

import pytest

from plancurate.tasks.lake.bucket import VARIABLE

from ..homes import NewHome
from ..integration.conftest import Command
from ..integration.test_runners import Rows, rows, words
from .conftest import BUCKET, SECRET, holds


@pytest.mark.parametrize("runner", ["dask", "ray"])
def test_a_study_on_a_cluster_with_its_lake_in_a_bucket(
    plancurate_on_shared_server: Command,
    on_threads: Rows,
    store: dict[str, str],
    new_home: NewHome,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    runner: str,
) -> None:
    variables = {**store, VARIABLE: f"s3://{BUCKET}/{runner}"}
    home = new_home(tmp_path / "home")
    done = plancurate_on_shared_server(*words(home, "tiny", runner), **variables)
    assert done.returncode == 0, done.stderr

    # Another machine, which has nothing.
    elsewhere = new_home(tmp_path / "elsewhere")
    again = plancurate_on_shared_server(*words(elsewhere, "tiny", "threads"), **variables)
    assert again.returncode == 0, again.stderr
    assert "nothing" in again.stdout
    checked = plancurate_on_shared_server("lake", "check", "--home", str(elsewhere), **variables)
    assert "nothing wrong" in checked.stdout
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert rows(elsewhere, "tiny") == rows(home, "tiny") == on_threads
    assert all(on_threads)

    said = done.stdout + done.stderr + again.stdout + again.stderr
    assert SECRET not in said
    assert not holds(tmp_path, SECRET)
