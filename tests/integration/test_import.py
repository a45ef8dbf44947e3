"""A study's candidates handed on, brought in elsewhere and selected from there; and sets that stay outside."""

from __future__ import annotations

import shlex
from pathlib import Path

import h5py
import numpy as np
import pytest

from plancurate.errors import PlancurateError
from plancurate.flows.cli.app import main
from plancurate.robots import load_robot
from plancurate.tasks.lake.home import Home
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study.candidates import make_part, missing_parts, study_targets
from plancurate.tasks.study.config import StudyConfig, load_config
from plancurate.tasks.study.context import open_study
from plancurate.tasks.study.selections import make_selection, study_selections

from .conftest import Command, Studied
from .test_bad_input import complaint
from .test_export import export

SELECTORS = ["General", "KMeans_Hybrid", "DemInf"]
MOTIONS = "SELECT target_id, q FROM trajectories WHERE solved AND verified"


def bring_in(folder: Path, home: Path, capsys: pytest.CaptureFixture[str], *words: str) -> list[str]:
    """Import a set; the words of the command that it says a study of the set begins with."""
    with pytest.raises(SystemExit) as stopped:
        main(("import", str(folder), "--preset", "smoke", "--home", str(home), *words))
    assert stopped.value.code == 0
    command = shlex.split(capsys.readouterr().out)
    assert command[:4] == ["plancurate", "study", "--preset", "smoke"]
    assert command[-2:] == ["--home", str(home)]
    return command[1:]


def brought_in(folder: Path, home: Path, capsys: pytest.CaptureFixture[str], *words: str) -> StudyConfig:
    """Import a set; the study that it says."""
    command = bring_in(folder, home, capsys, *words)
    return load_config("smoke", Path(command[command.index("--config") + 1]), {"selectors": SELECTORS})


def motions(home: Path) -> set[tuple[int, bytes]]:
    rows = Lake(home / "lake").sql(MOTIONS).to_pylist()
    return {(row["target_id"], np.float32(row["q"]).tobytes()) for row in rows}


@pytest.mark.parametrize("to", ["lerobot", "robomimic"])
def test_what_is_exported_and_imported_elsewhere_is_the_same_and_selected_from(
    smoke: Studied, tmp_path: Path, capsys: pytest.CaptureFixture[str], to: str
) -> None:
    export(smoke, tmp_path / "out", to)
    capsys.readouterr()
    home = tmp_path / "home"
    config = brought_in(tmp_path / "out", home, capsys)
    assert motions(home) == motions(smoke.untouched)
    assert brought_in(tmp_path / "out", home, capsys) == config
    assert len(Lake(home / "lake").sql(MOTIONS)) == len(motions(home))
    study = open_study(config, Home(home))
    (pool,) = study.pools
    assert not missing_parts(study, pool, study_targets(study, pool))
    selections = [make_selection(study, wanted) for wanted in study_selections(study)]
    assert [selection.selector for selection in selections] == SELECTORS
    assert len(selections[0].kept) == len(motions(home))
    assert [len(selection.kept) for selection in selections[1:]] == [4, 4]
    found = Lake(home / "lake").sql("SELECT * FROM trajectories").to_pylist()
    assert {(row["planner"], row["timing_method"]) for row in found} == {("Recorded", "recorded")}


def test_a_study_of_an_imported_set_goes_the_whole_way(
    smoke: Studied, tmp_path: Path, capsys: pytest.CaptureFixture[str], plancurate_on_shared_server: Command
) -> None:
    export(smoke, tmp_path / "out", "robomimic")
    capsys.readouterr()
    home = tmp_path / "a home"
    begun = bring_in(tmp_path / "out", home, capsys)
    short = ("--policies", "BC_MLP", "--training.steps", "20")
    done = plancurate_on_shared_server(*begun, "--selectors", "General", "KMeans_Hybrid", *short)
    assert done.returncode == 0, done.stderr
    assert "General, which keeps every candidate" in " ".join(done.stdout.split())
    found = (
        Lake(home / "lake").sql("SELECT selector, count(*) AS n FROM evaluations GROUP BY ALL").to_pylist()
    )
    assert {(row["selector"], row["n"]) for row in found} >= {("General", 32), ("KMeans_Hybrid", 32)}


def test_where_targets_have_few_episodes_dbscan_takes_none_for_noise(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = load_robot("h2017")
    ends = robot.home + np.array([[0.3, 0, 0, 0, 0, 0], [0, 0.2, 0, 0, 0, 0], [0, 0, 0.25, 0, 0, 0]])
    with h5py.File(tmp_path / "set.hdf5", "w") as written:
        for number, end in enumerate(ends):
            share = (1 - np.cos(np.linspace(0, np.pi, 41))) / 2
            path = robot.home + share[:, None] * (end - robot.home)
            written[f"data/demo_{number}/obs/joint_positions"] = path
    home = tmp_path / "home"
    bring_in(tmp_path / "set.hdf5", home, capsys, "--dt", "0.05")
    (file,) = (home / "imports").iterdir()
    study = open_study(load_config("smoke", file, {"budgets": [1]}), Home(home))
    kept = {
        wanted.choice.label: len(make_selection(study, wanted).kept) for wanted in study_selections(study)
    }
    assert kept["DBSCAN"] == kept["DBSCAN_Hybrid"] == kept["KMeans"] == 3


def hdf5(file: Path, q: np.ndarray) -> Path:
    with h5py.File(file, "w") as written:
        written["data/demo_0/obs/joint_positions"] = q
    return file


def test_a_set_without_a_candidate_is_refused_and_nothing_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    home, words = load_robot("h2017").home, ("--dt", "0.05", "--home", str(tmp_path / "home"))
    for step, why in ((0.2, "exceeds its velocity limit"), (100.0, "leaves its position limits")):
        file = hdf5(tmp_path / "set.hdf5", np.array([home, home + step]))
        said = complaint(capsys, "import", str(file), *words)
        assert "none of 1 episodes is a candidate; the first: " in said
        assert why in said
    assert "seconds with --dt" in complaint(capsys, "import", str(file), *words[2:])
    assert "one scene" in complaint(capsys, "import", str(file), *words, "--scenes", "free", "table")
    assert "--same-target: 0.0 m" in complaint(capsys, "import", str(file), *words, "--same-target", "0")
    assert not (tmp_path / "home").exists()


def test_a_part_of_a_set_and_a_start_elsewhere_are_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    home = load_robot("h2017").home
    hdf5(tmp_path / "set.hdf5", np.array([home + 0.01, home + 0.0105]))
    with h5py.File(tmp_path / "set.hdf5", "a") as file:
        file["data/demo_1/obs/joint_positions"] = np.array([home, home + 0.2])
    with pytest.raises(SystemExit):
        main(("import", str(tmp_path), "--dt", "0.05", "--home", str(tmp_path / "home")))
    said = capsys.readouterr().err
    assert "1 of 2 episodes to 2 targets are candidates" in said
    assert "the first that is none: " in said
    assert "1 of them do not begin at the robot's home" in said


def test_more_targets_than_a_set_has_are_not_drawn(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    home = load_robot("h2017").home
    hdf5(tmp_path / "set.hdf5", np.array([home, home + 0.0005]))
    config = brought_in(tmp_path, tmp_path / "home", capsys, "--dt", "0.05")
    more = open_study(config.model_copy(update={"n_targets": 2}), Home(tmp_path / "home"))
    with pytest.raises(PlancurateError, match="target 1 of 2: recorded set"):
        study_targets(more, more.pools[0])


def test_nobody_plans_what_was_recorded(tmp_path: Path) -> None:
    config = load_config("smoke", None, {"planners": ["Recorded"], "n_targets": 1})
    study = open_study(config, Home(tmp_path))
    (pool,) = study.pools
    (part,) = missing_parts(study, pool, study_targets(study, pool))
    with pytest.raises(PlancurateError, match=r"planner Recorded: .* names no set"):
        make_part(study, part)
