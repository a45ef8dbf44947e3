"""A study on a cluster with its lake in an S3-compatible store has the rows of one on threads with files."""

from __future__ import annotations

from pathlib import Path

import pytest

from plancurate.errors import PlancurateError
from plancurate.flows.server.services import HOST
from plancurate.flows.task_runs import shared_runner
from plancurate.tasks.lake.bucket import VARIABLE
from plancurate.tasks.lake.schema import table
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study.config import load_config

from ..homes import NewHome
from ..integration.conftest import Command
from ..lakes import POOL
from .conftest import BUCKET, SECRET, holds
from .tiny_study import Rows, rows, words


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
    assert "nothing to do" in again.stderr
    checked = plancurate_on_shared_server("lake", "check", "--home", str(elsewhere), **variables)
    assert "nothing wrong" in checked.stdout
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert rows(elsewhere, "tiny") == rows(home, "tiny") == on_threads
    assert all(on_threads)

    said = done.stdout + done.stderr + again.stdout + again.stderr
    assert SECRET not in said
    assert not holds(tmp_path, SECRET)


@pytest.mark.parametrize(
    ("place", "address", "said"),
    [
        ("s3://nobodys/lake", None, "bucket does not exist"),
        (f"s3://{BUCKET}/lake", f"http://{HOST}:1", "error sending request"),
    ],
)
def test_a_bucket_that_can_not_be_used_is_said_in_one_line(
    store: dict[str, str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    place: str,
    address: str | None,
    said: str,
) -> None:
    for name, value in {
        **store,
        VARIABLE: place,
        "AWS_ENDPOINT_URL": address or store["AWS_ENDPOINT_URL"],
    }.items():
        monkeypatch.setenv(name, value)
    for use in (Lake.keys, written):
        with pytest.raises(PlancurateError, match=said) as error:
            use(Lake(tmp_path / "lake"), "targets", POOL)
        assert str(error.value).startswith(f"{place}: ")
        assert "\n" not in str(error.value)
        assert SECRET not in str(error.value)


def written(lake: Lake, name: str, partition: dict[str, str]) -> Path:
    return lake.write(name, partition, "000", table(name).schema.empty_table(), {})


@pytest.mark.parametrize(
    "cluster",
    [
        {"runner": "dask", "dask_scheduler": f"tcp://{HOST}:1"},
        {"runner": "ray", "ray_address": f"{HOST}:1"},
    ],
)
def test_a_cluster_that_does_not_answer_is_said_in_one_line(cluster: dict[str, str]) -> None:
    name = cluster["runner"]
    with (
        pytest.raises(PlancurateError, match=f"^runner = {name}: no cluster: .*refused$"),
        shared_runner(load_config("smoke", None, cluster)),
    ):
        pass
