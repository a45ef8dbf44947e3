"""The exports as robomimic and LeRobot themselves load them: `make test-exports` makes the environment and runs this.

Both packages are heavy and ask for other versions than this one, so they run in an environment of their own.
"""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from plancurate.tasks.curation.pool import FloatArray
from plancurate.tasks.exports.episodes import Episodes
from plancurate.tasks.exports.formats import write_export
from plancurate.tasks.exports.names import Format

PYTHON = Path(os.environ.get("EXPORTS_PYTHON", ".venv-exports/bin/python")).absolute()
LOADERS = Path(__file__).with_name("loaders")
SELECTIONS = ("Ranked", "Stepwise", "Shorter")


def run(*words: str | Path) -> str:
    done = subprocess.run(
        [str(PYTHON), *map(str, words)],
        capture_output=True,
        text=True,
        env=os.environ | {"HF_HUB_OFFLINE": "1", "HF_DATASETS_CACHE": str(Path(words[-2]).parent / "cache")},
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def load(to: Format, path: Path, selection: str) -> dict[str, Any]:
    return json.loads(run(LOADERS / f"{to}_loader.py", path, selection).splitlines()[-1])


@pytest.fixture(scope="module")
def demonstrations(episodes: Episodes, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("exports") / "robomimic"
    write_export(episodes, "robomimic", folder)
    return folder / "demonstrations.hdf5"


@pytest.fixture(scope="module")
def dataset(episodes: Episodes, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("exports") / "lerobot"
    write_export(episodes, "lerobot", folder)
    return folder


@pytest.fixture(scope="module")
def paths(waypoints: Mapping[str, FloatArray]) -> list[FloatArray]:
    """Waypoints of every episode."""
    return [*waypoints.values(), waypoints["t1-r2"][::2]]


def kept(episodes: Episodes, selection: str) -> list[int]:
    return next(marks.kept for marks in episodes.marks if marks.name == selection)


@pytest.mark.parametrize("selection", SELECTIONS)
def test_robomimics_mask_gives_exactly_the_selection(
    demonstrations: Path, episodes: Episodes, paths: list[FloatArray], selection: str
) -> None:
    loaded = load("robomimic", demonstrations, selection)
    own = kept(episodes, selection)
    assert loaded["demos"] == [f"demo_{number}" for number in own]
    assert loaded["sequences"] == sum(len(paths[number]) for number in own)
    q, first = paths[own[0]], loaded["first"]
    np.testing.assert_allclose(first["joint_positions"], q[:4], atol=1e-6)
    np.testing.assert_allclose(first["next_joint_positions"], q[1:5], atol=1e-6)
    scale = np.array(loaded["environment"]["env_kwargs"]["action_scale"])
    np.testing.assert_allclose(first["actions"] * scale, np.diff(q[:5], axis=0), atol=1e-6)
    assert loaded["shapes"] == {"joint_positions": [6], "target_offset": [3]}
    assert loaded["action_dimension"] == 6


def test_robomimics_own_check_of_a_file_passes(demonstrations: Path) -> None:
    said = run("-m", "robomimic.scripts.get_dataset_info", "--dataset", demonstrations)
    assert "total trajectories: 7" in said
    assert "filter key Ranked with 2 demos" in said


@pytest.mark.parametrize("selection", SELECTIONS)
def test_lerobots_filter_gives_exactly_the_selection(
    dataset: Path, episodes: Episodes, paths: list[FloatArray], selection: str
) -> None:
    loaded = load("lerobot", dataset, selection)
    own = kept(episodes, selection)
    chosen = [paths[number] for number in own]
    assert loaded["episodes"] == own
    assert loaded["ids"] == [episodes.about["trajectory_id"][number].as_py() for number in own]
    assert loaded["part"] == [len(own), sum(map(len, chosen))]
    assert loaded["whole"] == [7, sum(map(len, paths))]
    np.testing.assert_array_equal(np.float32(loaded["state"]), np.float32(np.concatenate(chosen)))
    np.testing.assert_array_equal(np.float32(loaded["action"]), np.float32(chosen[0][1:5]))
    assert loaded["environment"] == [3 + 72]
    np.testing.assert_allclose(loaded["mean"], np.concatenate(paths).mean(axis=0), atol=1e-6)
