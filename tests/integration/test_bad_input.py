"""Every mistake a user can make gets one line that says what would be right, exit code 2, and nothing written."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
import yaml

import plancurate.robots
from plancurate.flows.cli.app import main

from ..homes import UNCONFIGURED, NewHome
from .conftest import Command, Studied

ROBOT = Path(plancurate.robots.__file__).parent / "h2017"


@pytest.fixture(autouse=True)
def unconfigured(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in UNCONFIGURED:
        monkeypatch.delenv(name, raising=False)


def complaint(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """Run a command that must fail and return its one line."""
    with pytest.raises(SystemExit) as stopped:
        main(words)
    said = capsys.readouterr().err
    assert stopped.value.code == 2, said
    lines = [line for line in said.splitlines() if line.startswith("plancurate: ")]
    assert len(lines) == 1, said
    assert "Traceback" not in said
    return lines[0]


@pytest.mark.parametrize(
    ("option", "value", "hint"),
    [
        ("--robot", "h2071", "h2017"),
        ("--scene", "tabel", "table"),
        ("--planners", "RTTConnect", "RRTConnect"),
        ("--selectors", "KMean", "KMeans"),
        ("--policies", "BC_RRN", "BC_RNN"),
        ("--preset", "quik", "quick"),
    ],
)
def test_an_unknown_name_is_answered_with_the_nearest_names(
    option: str, value: str, hint: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    home = tmp_path / "home"
    line = complaint(capsys, "generate", option, value, "--home", str(home))
    assert value in line
    assert hint in line
    assert not (home / "lake").exists()


def test_an_unknown_option_is_answered_with_the_nearest(capsys: pytest.CaptureFixture[str]) -> None:
    assert "--planners" in complaint(capsys, "generate", "--planer", "RRT")


def test_a_field_that_is_wrong_in_a_file_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text("training: {steps: -5}\n")
    line = complaint(capsys, "generate", "--config", str(file), "--home", str(tmp_path / "home"))
    assert "mine.yaml" in line
    assert "training.steps = -5" in line


def robot_folder(folder: Path) -> Path:
    shutil.copytree(ROBOT, folder)
    return folder


def test_a_urdf_with_an_unsupported_joint_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = robot_folder(tmp_path / "planar")
    urdf = folder / "robot.urdf"
    urdf.write_text(
        urdf.read_text().replace('name="joint_3" type="revolute"', 'name="joint_3" type="planar"')
    )
    line = complaint(capsys, "generate", "--robot", str(folder), "--home", str(tmp_path / "home"))
    assert "robot.urdf" in line
    assert "joint_3" in line
    assert "planar" in line


def scene_file(file: Path, **scene: object) -> str:
    file.write_text(yaml.safe_dump(scene))
    return str(file)


def test_a_start_in_collision_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    box = {"name": "block", "kind": "box", "xyz": [0.7, 0, 1.0], "size": [0.3, 0.3, 0.3]}
    scene = scene_file(tmp_path / "blocked.yaml", ground=0.0, margin=0.005, shapes=[box])
    line = complaint(
        capsys, "generate", "--preset", "smoke", "--scene", scene, "--home", str(tmp_path / "home")
    )
    assert "home" in line
    assert "blocked" in line


def test_targets_that_nothing_can_reach_are_reported(
    new_home: NewHome, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    home = new_home(tmp_path / "home")
    file = tmp_path / "far.yaml"
    file.write_text("candidates: {targets: {range_m: 50.0, max_tries: 5}}\n")
    line = complaint(capsys, "generate", "--preset", "smoke", "--config", str(file), "--home", str(home))
    assert "reaches none of 5 positions" in line


def test_an_empty_pool_is_reported(
    new_home: NewHome, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    home = new_home(tmp_path / "home")
    line = complaint(capsys, "curate", "--preset", "smoke", "--home", str(home))
    assert "generate" in line


def test_a_budget_larger_than_a_cluster_is_reported_and_nothing_else_is_said(
    smoke: Studied, plancurate: Command
) -> None:
    done = plancurate("curate", "--preset", "smoke", "--budgets", "500", "--home", str(smoke.home))
    heading, line = (
        done.stderr.splitlines()
    )  # what a failed task holds must not be left when the process ends
    assert (done.returncode, heading) == (2, f"curate smoke  {smoke.home}")
    assert line.startswith("plancurate: ")
    assert "500" in line


@pytest.fixture
def damaged(smoke: Studied, tmp_path: Path) -> Path:
    """A copy of the smoke study's lake to be damaged."""
    shutil.copytree(smoke.home / "lake", tmp_path / "home" / "lake")
    return tmp_path / "home"


def test_a_torn_part_is_named(damaged: Path, capsys: pytest.CaptureFixture[str]) -> None:
    part = next((damaged / "lake" / "trajectories").rglob("part-0*.parquet"))
    part.write_bytes(part.read_bytes()[:1000])
    assert part.name in complaint(capsys, "report", "--study", "smoke", "--home", str(damaged))


def test_a_foreign_parquet_file_is_named(damaged: Path, capsys: pytest.CaptureFixture[str]) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    part = next((damaged / "lake" / "trajectories").rglob("part-0*.parquet"))
    pq.write_table(pa.table({"x": [1]}), part)
    line = complaint(capsys, "sql", "SELECT 1", "--home", str(damaged))
    assert part.name in line
    assert "not written by plancurate" in line


def test_a_lake_of_another_schema_version_is_refused(
    damaged: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    import pyarrow.parquet as pq

    part = next((damaged / "lake" / "trajectories").rglob("part-0*.parquet"))
    rows = pq.read_table(part)
    footer = dict(rows.schema.metadata) | {b"plancurate.schema_version": b"999"}
    pq.write_table(rows.replace_schema_metadata(footer), part)
    assert "999" in complaint(capsys, "sql", "SELECT 1", "--home", str(damaged))


def test_an_unreachable_prefect_server_is_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PREFECT_API_URL", "http://127.0.0.1:9/api")
    line = complaint(capsys, "generate", "--preset", "smoke", "--home", str(tmp_path / "home"))
    assert "http://127.0.0.1:9/api" in line
    assert not (tmp_path / "home" / "lake").exists()


def test_an_unreachable_mlflow_server_is_reported_before_any_work(
    new_home: NewHome, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    home = new_home(tmp_path / "home")
    monkeypatch.setenv("MLFLOW_TRACKING_URI", "http://127.0.0.1:9")
    line = complaint(capsys, "study", "--preset", "smoke", "--home", str(home))
    assert "http://127.0.0.1:9" in line
    assert not (home / "lake").exists()


def test_a_missing_lake_and_an_unknown_study_are_reported(
    smoke: Studied, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert str(tmp_path) in complaint(capsys, "report", "--study", "smoke", "--home", str(tmp_path))
    assert "smoke" in complaint(capsys, "report", "--study", "smoker", "--home", str(smoke.home))


def test_sql_that_would_write_is_refused(smoke: Studied, capsys: pytest.CaptureFixture[str]) -> None:
    line = complaint(capsys, "sql", "CREATE TABLE x AS SELECT 1", "--home", str(smoke.home))
    assert "SELECT" in line
