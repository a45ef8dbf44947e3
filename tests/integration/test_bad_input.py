"""Every mistake a user can make gets one line that says what would be right, exit code 2, and nothing written."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
import yaml

import plancurate.robots
from plancurate.errors import PlancurateError
from plancurate.flows.cli.app import main
from plancurate.flows.cli.fields import leaves
from plancurate.tasks.lake.home import Home
from plancurate.tasks.lake.manifest import append, entry_of
from plancurate.tasks.study.config import StudyConfig, load_config
from plancurate.tasks.study.context import open_study

from ..homes import UNCONFIGURED
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


HUGE = str(10**30)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "hints"),
    [
        (["--targets", "0"], ["--n-targets = '0'", "greater than or equal to 1"]),
        (["--targets", "1.5"], ["--n-targets = '1.5'", "valid integer"]),
        (["--workers", "-3"], ["--workers = '-3'"]),
        (["--seeds", "0", HUGE], [f"--seeds = '{HUGE}'", "2147483647"]),
        (["--budgets", HUGE], ["--budgets", "2147483647"]),
        (["--candidates.verify.hold_s", "1e308"], ["--candidates.verify.hold-s = '1e308'", "2147483647"]),
        (["--candidates.plan.run", "3"], ["--candidates.plan.run", "did you mean runs"]),
        (["--candidates.plan", "3"], ["--candidates.plan = '3'", "dictionary"]),
        (["--pools.raw.plan.runs", "0"], ["pools.raw.plan.runs = '0'", "greater than 0"]),
        (["--pools.raw.plan.run", "1"], ["pools.raw.plan.run", "did you mean runs"]),
        (["--pools", "raw"], ["--pools = 'raw'", "dictionary"]),
        (["--selectors", "{nam: KMeans}"], ["--selectors.name", "required"]),
        (["--selectors", "{name: KMeans: 3}"], ["{name: KMeans: 3}", "not valid YAML"]),
        (["--selectors", "[" * 3000], ["nests too deep"]),
        (["--selectors", "KMeans", "KMeans"], ["--selectors", "twice"]),
        (["--planners", "RRT", "RRT"], ["--planners", "twice"]),
        (["--planners"], ["--planners", "at least 1"]),
        (["--scene", "free", "free"], ["--scenes", "twice"]),
        (["--seeds", "1", "1"], ["--seeds", "twice"]),
        (["--name", "a/b"], ["--name = 'a/b'", "pattern"]),
        (["--name", "x" * 300], ["--name", "at most 100"]),
        (["--robot", "x" * 300], ["File name too long"]),
        (["--workers", "2", "--workers", "3"], ["--workers", "multiple times"]),
    ],
)
def test_a_wrong_option_is_named_with_what_would_be_right(
    words: list[str], hints: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line = complaint(capsys, "generate", *words, "--home", str(tmp_path / "home"))
    assert [hint for hint in hints if hint not in line] == []
    assert len(line) < 500
    assert not (tmp_path / "home").exists()


NUMBERS = [
    name for name, value, _ in leaves(StudyConfig()) if type(value) in (int, float) or name.endswith("_m")
]


@pytest.mark.parametrize("field", NUMBERS)
def test_no_number_may_be_infinite_or_absurdly_large(field: str) -> None:
    *sections, name = field.split(".")
    for number in ("inf", "-inf", "nan", "1e308", HUGE, f"-{HUGE}"):
        values: dict[str, object] = {name: number}
        for section in reversed(sections):
            values = {section: values}
        with pytest.raises(PlancurateError, match=f"^--{field.replace('_', '-')} = '{number}': "):
            load_config("quick", None, values)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("content", "hints"),
    [
        (b"training: {steps: -5}", ["training.steps = -5", "greater than or equal to 1"]),
        (b"n_target: 3", ["n_target", "did you mean n_targets"]),
        (b"candidates: {plan: {run: 3}}", ["candidates.plan.run", "did you mean runs"]),
        (b"candidates: {plan: {seconds: .inf}}", ["candidates.plan.seconds = inf", "2147483647"]),
        (b"candidates: {plan: {seconds: 1.0e+308}}", ["candidates.plan.seconds = 1e+308", "2147483647"]),
        (b"unseen: " + HUGE.encode(), ["unseen", HUGE]),
        (b"unseen: " + b"9" * 5000, ["not valid YAML"]),
        (b"candidates: null", ["candidates = None", "dictionary"]),
        (b"name: one\nseeds: [1]\nname: two", ["'name' is given twice", "line 3"]),
        (b"name: Caf\xe9", ["not UTF-8", "byte 9"]),
        (b"[" * 5000, ["nests too deep"]),
        (b"seeds: [1", ["not valid YAML"]),
        (b"seeds: 2024-13-45", ["not valid YAML"]),
        (b"- 1", ["holds a list", "mapping"]),
        (b"", ["holds nothing", "mapping"]),
    ],
)
def test_a_wrong_file_is_named_with_field_value_and_what_would_be_right(
    content: bytes, hints: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "mine.yaml"
    file.write_bytes(content)
    line = complaint(capsys, "generate", "--config", str(file), "--home", str(tmp_path / "home"))
    assert [hint for hint in ["mine.yaml", *hints] if hint not in line] == []
    assert not (tmp_path / "home").exists()


@pytest.mark.parametrize("name", ["", "missing.yaml"])
def test_a_configuration_that_is_no_file_is_refused(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / name
    assert str(file) in complaint(capsys, "generate", "--config", str(file), "--home", str(tmp_path / "home"))


@pytest.mark.parametrize("home", ["file", "file/below", "/proc/home", "~nobody-has-this-name/home"])
def test_a_home_that_cannot_be_one_is_refused(
    home: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    place = home if home.startswith("~") else str(tmp_path / home)
    for words in (
        ["generate"], ["study"], ["sql", "SELECT 1"], ["report", "--study", "quick"], ["compare", "a", "b"],
    ):  # fmt: skip
        assert place in complaint(capsys, *words, "--home", place)
    assert (tmp_path / "file").read_bytes() == b""


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


def test_a_scene_of_absurd_size_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    box = {"name": "block", "kind": "box", "xyz": [5.0, 0, 1.0], "size": [1e308, 0.3, 0.3]}
    scene = scene_file(tmp_path / "vast.yaml", ground=0.0, margin=0.005, shapes=[box])
    line = complaint(capsys, "generate", "--scene", scene, "--home", str(tmp_path / "home"))
    assert "vast.yaml: shapes.0.box.size.0 = 1e+308" in line


@pytest.fixture
def configured(shared_server: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A Prefect server is configured, so that none has to be started."""
    monkeypatch.setenv("PREFECT_API_URL", shared_server)


@pytest.mark.usefixtures("configured")
def test_targets_that_nothing_can_reach_are_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "far.yaml"
    file.write_text("candidates: {targets: {range_m: 50.0, max_tries: 5}}\n")
    line = complaint(capsys, "generate", "--preset", "smoke", "--config", str(file), "--home", str(tmp_path))
    assert "reaches none of 5 positions" in line


@pytest.mark.usefixtures("configured")
def test_an_empty_pool_is_reported(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = complaint(capsys, "curate", "--preset", "smoke", "--home", str(tmp_path / "home"))
    assert "generate" in line


def test_a_selector_that_finds_no_cluster_is_reported_and_nothing_else_is_said(
    smoke: Studied, plancurate_on_shared_server: Command, tmp_path: Path
) -> None:
    home = Home(shutil.copytree(smoke.untouched, tmp_path / "home"))
    selector = {"name": "DBSCAN", "eps_m": 1e-9, "min_samples": 500}
    words = ("curate", "--preset", "smoke", "--selectors", json.dumps(selector), "--home", str(home.root))
    done = plancurate_on_shared_server(*words)
    # What a failed task holds must not be left when the process ends.
    *heading, line = done.stderr.splitlines()
    study = open_study(load_config("smoke", None, {"selectors": [selector]}), home).study
    assert (done.returncode, "".join(heading)) == (2, f"curate {study}  {home.root}")
    assert line.startswith("plancurate: ")
    assert "every candidate is noise" in line


@pytest.fixture
def damaged(smoke: Studied, tmp_path: Path) -> Path:
    """A copy of the smoke study's lake to be damaged."""
    shutil.copytree(smoke.untouched / "lake", tmp_path / "home" / "lake")
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
    append(part.parent, entry_of(part, part.name, 1))
    line = complaint(capsys, "report", "--study", "smoke", "--home", str(damaged))
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
    append(part.parent, entry_of(part, part.name, rows.num_rows))
    assert "999" in complaint(capsys, "report", "--study", "smoke", "--home", str(damaged))


@pytest.mark.slow
def test_an_unreachable_prefect_server_is_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PREFECT_API_URL", "http://127.0.0.1:9/api")
    line = complaint(capsys, "generate", "--preset", "smoke", "--home", str(tmp_path / "home"))
    assert "http://127.0.0.1:9/api" in line
    assert not (tmp_path / "home" / "lake").exists()


@pytest.mark.usefixtures("configured")
def test_an_unreachable_mlflow_server_is_reported_before_any_work(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MLFLOW_TRACKING_URI", "http://127.0.0.1:9")
    line = complaint(capsys, "study", "--preset", "smoke", "--home", str(tmp_path / "home"))
    assert "http://127.0.0.1:9" in line
    assert not (tmp_path / "home" / "lake").exists()


def test_a_missing_lake_and_an_unknown_study_are_reported(
    smoke: Studied, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert str(tmp_path) in complaint(capsys, "report", "--study", "smoke", "--home", str(tmp_path))
    assert "smoke" in complaint(capsys, "report", "--study", "smoker", "--home", str(smoke.untouched))


def test_sql_that_would_write_is_refused(smoke: Studied, capsys: pytest.CaptureFixture[str]) -> None:
    line = complaint(capsys, "sql", "CREATE TABLE x AS SELECT 1", "--home", str(smoke.untouched))
    assert "SELECT" in line
