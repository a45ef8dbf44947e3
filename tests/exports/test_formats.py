"""What the files of each format hold, read by the libraries that others read them with."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from plancurate.errors import PlancurateError
from plancurate.tasks.curation.pool import FloatArray
from plancurate.tasks.exports.episodes import Episodes
from plancurate.tasks.exports.formats import write_export


@pytest.fixture(scope="module")
def demonstrations(episodes: Episodes, tmp_path_factory: pytest.TempPathFactory) -> h5py.File:
    folder = tmp_path_factory.mktemp("exports") / "robomimic"
    write_export(episodes, "robomimic", folder)
    return h5py.File(folder / "demonstrations.hdf5")


@pytest.fixture(scope="module")
def dataset(episodes: Episodes, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("exports") / "lerobot"
    write_export(episodes, "lerobot", folder)
    return folder


def test_a_demonstration_moves_by_its_actions_from_each_observation_to_the_next(
    demonstrations: h5py.File, waypoints: Mapping[str, FloatArray]
) -> None:
    data = demonstrations["data"]
    assert data.attrs["total"] == sum(demo.attrs["num_samples"] for demo in data.values())
    for number, q in enumerate(waypoints.values()):
        demo = data[f"demo_{number}"]
        now, then = demo["obs/joint_positions"][:], demo["next_obs/joint_positions"][:]
        np.testing.assert_array_equal(now, np.float32(q))
        np.testing.assert_allclose(then - now, demo["actions"][:] * data.attrs["action_scale"], atol=1e-6)
        np.testing.assert_array_equal(demo["next_obs/target_offset"][:-1], demo["obs/target_offset"][1:])
        assert demo["dones"][:].tolist() == demo["rewards"][:].tolist() == [0] * (len(q) - 1) + [1]


def test_actions_are_within_the_bounds_that_robomimic_asks_for(demonstrations: h5py.File) -> None:
    actions = np.concatenate([demo["actions"][:] for demo in demonstrations["data"].values()])
    assert 0.1 < np.abs(actions).max() <= 1


def test_masks_name_what_selections_keep(demonstrations: h5py.File) -> None:
    masks = {name: mask[:].tolist() for name, mask in demonstrations["mask"].items()}
    assert masks == {
        "Ranked": [b"demo_1", b"demo_5"],
        "Stepwise": [b"demo_0", b"demo_3"],
        "Shorter": [b"demo_6"],
    }
    assert demonstrations["mask/Ranked"].attrs["budget"] == 2
    assert demonstrations["curation/Ranked/score"][:].tolist() == [-1, -2]
    assert demonstrations["data/demo_0/keep/Stepwise"][:].tolist() == [1, 0, 0, 1, 0]
    assert demonstrations["data/demo_6"].attrs["made_by"] == "Shorter"


def test_the_environment_says_how_to_undo_the_scaling(demonstrations: h5py.File) -> None:
    data = demonstrations["data"]
    environment = json.loads(data.attrs["env_args"])
    assert environment["type"] == 2
    np.testing.assert_allclose(environment["env_kwargs"]["action_scale"], data.attrs["action_scale"])


def test_frames_of_the_data_set_are_the_waypoints_with_the_next_ones_as_actions(
    dataset: Path, waypoints: Mapping[str, FloatArray]
) -> None:
    frames = pq.read_table(dataset / "data/chunk-000/file-000.parquet")
    assert frames["action"].type == pa.list_(pa.float32(), 6)
    state, action = np.array(frames["observation.state"].to_pylist()), np.array(frames["action"].to_pylist())
    number = frames["episode_index"].to_numpy()
    for episode, q in enumerate(waypoints.values()):
        np.testing.assert_array_equal(state[number == episode], np.float32(q))
        np.testing.assert_array_equal(action[number == episode], np.float32([*q[1:], q[-1]]))
    assert frames["index"].to_pylist() == list(range(len(frames)))
    expected = np.float32(frames["frame_index"].to_numpy() / 20)
    np.testing.assert_array_equal(frames["timestamp"].to_numpy(), expected)
    assert np.flatnonzero(frames["keep.Stepwise"].to_numpy()).tolist()[:2] == [0, 3]


def test_each_episode_is_a_row_group_that_its_row_points_to(dataset: Path) -> None:
    rows = pq.read_table(dataset / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    file = pq.ParquetFile(dataset / "data/chunk-000/file-000.parquet")
    for number, row in enumerate(rows):
        group = file.read_row_group(number)
        assert set(group["episode_index"].to_pylist()) == {row["episode_index"]} == {number}
        assert group["index"].to_pylist() == list(range(row["dataset_from_index"], row["dataset_to_index"]))
        assert row["length"] == len(group)
    tasks = pd.read_parquet(dataset / "meta/tasks.parquet")
    assert [tasks.loc[row["tasks"][0], "task_index"] for row in rows] == [0, 0, 0, 1, 1, 1, 1]


def test_a_filter_of_episodes_is_one_line(dataset: Path) -> None:
    episodes = pd.read_parquet(dataset / "meta/episodes")
    assert episodes.index[episodes["kept/Ranked"]].tolist() == [1, 5]
    assert episodes.loc[5, ["selector/Ranked", "score/Ranked", "rank/Ranked"]].tolist() == [
        "Ranked",
        -2.0,
        2.0,
    ]
    curation = json.loads((dataset / "meta/curation.json").read_text())
    assert {name: entry["episodes"] for name, entry in curation.items()} == {
        "Ranked": [1, 5], "Stepwise": [0, 3], "Shorter": [6]
    }  # fmt: skip


def test_statistics_are_those_of_the_frames(dataset: Path) -> None:
    frames = pq.read_table(dataset / "data/chunk-000/file-000.parquet")
    state = np.array(frames["observation.state"].to_pylist(), dtype=float)
    stats = json.loads((dataset / "meta/stats.json").read_text())["observation.state"]
    np.testing.assert_allclose(stats["std"], state.std(axis=0))
    np.testing.assert_allclose(stats["q99"], np.quantile(state, 0.99, axis=0))
    assert stats["count"] == [len(state)]
    second = state[frames["episode_index"].to_numpy() == 1]
    row = pq.read_table(dataset / "meta/episodes/chunk-000/file-000.parquet").slice(1, 1).to_pylist()[0]
    np.testing.assert_allclose(row["stats/observation.state/mean"], second.mean(axis=0))


def test_the_description_fits_the_frames(dataset: Path, episodes: Episodes) -> None:
    info = json.loads((dataset / "meta/info.json").read_text())
    frames = pq.read_table(dataset / "data/chunk-000/file-000.parquet")
    assert set(info["features"]) == set(frames.column_names)
    assert (info["fps"], info["total_frames"], info["total_episodes"]) == (20, len(frames), 7)
    for name, feature in info["features"].items():
        assert feature["names"] is None or len(feature["names"]) == feature["shape"][0], name
    assert info["features"]["observation.state"]["names"] == list(episodes.robot.joint_names)


def test_steps_that_are_no_whole_number_a_second_are_refused_and_nothing_is_written(
    episodes: Episodes, tmp_path: Path
) -> None:
    with pytest.raises(PlancurateError, match=r"0\.03 s, 33\.3333 frames a second"):
        write_export(replace(episodes, dt=0.03), "lerobot", tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_holds_something_is_refused(episodes: Episodes, tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("keep me")
    with pytest.raises(PlancurateError, match="new or empty folder"):
        write_export(episodes, "robomimic", tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_without_h5py_one_line_says_what_to_install(
    episodes: Episodes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(PlancurateError, match=r"pip install 'plancurate\[exports\]'"):
        write_export(episodes, "robomimic", tmp_path / "out")
    assert list(tmp_path.iterdir()) == []
