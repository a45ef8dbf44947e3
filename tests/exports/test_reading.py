"""Joint trajectories read back from the formats of other trainers, and what a set must not be."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.robots import Robot, Scene
from plancurate.tasks.candidates.recorded import RecordedSet, by_target, set_id
from plancurate.tasks.curation.pool import FloatArray
from plancurate.tasks.exports.episodes import Episodes
from plancurate.tasks.exports.formats import write_export
from plancurate.tasks.exports.names import Format
from plancurate.tasks.exports.reading import read_set

from .conftest import POSITIONS

FORMATS: tuple[Format, ...] = ("robomimic", "lerobot")
RNG = np.random.default_rng(1)


@pytest.fixture(scope="module")
def robot(world: tuple[Robot, Scene]) -> Robot:
    return world[0]


@pytest.fixture(scope="module")
def exported(episodes: Episodes, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with an export in each format."""
    folder = tmp_path_factory.mktemp("read")
    for to in FORMATS:
        write_export(episodes, to, folder / to)
    return folder


def lerobot(folder: Path, paths: Sequence[FloatArray], names: object, **changes: object) -> Path:
    """A set of somebody else's: nothing but joint states."""
    q, lengths = np.float32(np.concatenate(paths)), [len(path) for path in paths]
    (folder / "meta").mkdir(parents=True)
    (folder / "data/chunk-000").mkdir(parents=True)
    frames = {
        "observation.state": pa.array(q.tolist(), pa.list_(pa.float32())),
        "episode_index": np.repeat(np.arange(len(paths)), lengths),
        "index": np.arange(len(q)),
    }
    pq.write_table(pa.table(frames), folder / "data/chunk-000/file-000.parquet")
    state = {"dtype": "float32", "shape": [q.shape[1]], "names": names}
    info = {
        "codebase_version": "v3.0", "fps": 20, "total_frames": len(q), "features": {"observation.state": state}
    }  # fmt: skip
    (folder / "meta/info.json").write_text(json.dumps(info | changes))
    return folder


def robomimic(file: Path, paths: Sequence[FloatArray], key: str, **said: object) -> Path:
    with h5py.File(file, "w") as written:
        data = written.create_group("data")
        data.attrs["env_args"] = json.dumps({"env_name": "Lift", "env_kwargs": said})
        for number, q in enumerate(paths):
            data.create_dataset(f"demo_{number}/obs/{key}", data=q)
    return file


@pytest.fixture
def paths(robot: Robot) -> list[FloatArray]:
    """Eleven motions of four frames: demo_10 must not come before demo_2."""
    steps = RNG.normal(0, 0.01, (11, 4, robot.dof))
    return list(np.float32(robot.home + np.cumsum(steps, axis=1)).astype(float))


@pytest.mark.parametrize("to", FORMATS)
def test_what_was_exported_is_read_back(
    exported: Path, robot: Robot, waypoints: Mapping[str, FloatArray], to: Format
) -> None:
    read = read_set(exported / to, robot)
    assert read.dt == 0.05
    expected = [*waypoints.values(), waypoints["t1-r2"][::2]]
    for episode, q in zip(read.episodes, expected, strict=True):
        np.testing.assert_array_equal(episode.q, np.float32(q))
    told = np.array([episode.target for episode in read.episodes])
    np.testing.assert_allclose(told, np.array(POSITIONS)[[0, 0, 0, 1, 1, 1, 1]], atol=1e-6)


def test_a_set_is_called_by_its_content_not_by_its_format(exported: Path, robot: Robot) -> None:
    grouped = [by_target(robot, read_set(exported / to, robot), 1e-3) for to in FORMATS]
    assert [len(episodes) for _, episodes in grouped[0]] == [3, 4]
    assert set_id(grouped[0], 1e-3) == set_id(grouped[1], 1e-3)
    assert set_id(grouped[0], 1e-3) != set_id(grouped[0][:1], 1e-3)


@pytest.mark.parametrize("key", ["joint_positions", "robot0_joint_pos"])
def test_demonstrations_come_in_order_of_their_numbers(
    robot: Robot, paths: list[FloatArray], tmp_path: Path, key: str
) -> None:
    read = read_set(robomimic(tmp_path / "low_dim.hdf5", paths, key, control_freq=20), robot)
    assert read.dt == 0.05
    for episode, q in zip(read.episodes, paths, strict=True):
        np.testing.assert_array_equal(episode.q, q)


def test_joints_are_found_by_name_in_any_order(robot: Robot, paths: list[FloatArray], tmp_path: Path) -> None:
    backwards = {"motors": ["gripper", *reversed(robot.joint_names)]}
    wider = [np.column_stack([np.zeros(len(q)), q[:, ::-1]]) for q in paths]
    read = read_set(lerobot(tmp_path / "set", wider, backwards), robot)
    np.testing.assert_array_equal(read.episodes[3].q, paths[3])


def test_without_targets_they_are_where_the_tool_ends(
    robot: Robot, paths: list[FloatArray], tmp_path: Path
) -> None:
    again = [*paths[:2], paths[0][::-1], paths[0]]
    recorded = read_set(lerobot(tmp_path / "set", again, None), robot)
    grouped = by_target(robot, recorded, 1e-3)
    assert [[episode.name[-1] for episode in episodes] for _, episodes in grouped] == [
        ["0", "3"],
        ["1"],
        ["2"],
    ]
    tool = native.fk(robot.native, np.array([q[-1] for q in again[:3]]))[:, :3, 3]
    np.testing.assert_allclose([target.position for target, _ in grouped], tool, atol=1e-12)
    np.testing.assert_array_equal(grouped[0][0].goals, paths[0][-1:])


def refused(place: Path, robot: Robot, said: str) -> None:
    with pytest.raises(PlancurateError, match=said):
        read_set(place, robot)


def test_wrong_sets_of_lerobot_are_refused(robot: Robot, paths: list[FloatArray], tmp_path: Path) -> None:
    names = list(robot.joint_names)
    broken = [paths[0], np.where(np.arange(4)[:, None] == 2, np.nan, paths[1])]
    refused(lerobot(tmp_path / "nan", broken, names), robot, f"episode 1: frame 2: {names[0]} is nan")
    refused(lerobot(tmp_path / "old", paths, names, codebase_version="v2.1"), robot, r"v2\.1; v3\.0 would be")
    few = [q[:, :5] for q in paths]
    refused(lerobot(tmp_path / "few", few, names[:5]), robot, f"no joint {names[5]} of robot h2017")
    refused(lerobot(tmp_path / "nameless", few, None), robot, r"\(6 joints\) among 5 columns without names")
    refused(lerobot(tmp_path / "still", [paths[0][:1]], names), robot, "episode 0: a motion has two frames")
    refused(lerobot(tmp_path / "cut", paths, names, total_frames=99), robot, r"44 frames, and .* says 99")
    refused(lerobot(tmp_path / "images", paths, names, features={}), robot, r"no feature observation\.state")
    refused(lerobot(tmp_path / "slow", paths, names, fps=0), robot, "fps 0; frames a second above 0")
    torn = lerobot(tmp_path / "torn", paths, names)
    (torn / "data/chunk-000/file-000.parquet").write_bytes(b"PAR1")
    refused(torn, robot, "torn/data: can't be read")
    (torn / "meta/info.json").write_text("[")
    refused(torn, robot, "not LeRobot's description")


def test_wrong_sets_of_robomimic_are_refused(robot: Robot, paths: list[FloatArray], tmp_path: Path) -> None:
    def wrong(
        said: str, paths: Sequence[FloatArray], key: str = "robot0_joint_pos", **kwargs: object
    ) -> None:
        refused(robomimic(tmp_path / "set.hdf5", paths, key, **kwargs), robot, said)

    wrong("nothing says how long a frame lasts; give it in seconds with --dt", paths)
    wrong("demo_0: no joint positions obs/joint_positions among robot0_eef_pos", paths, "robot0_eef_pos")
    wrong(r"demo_0: obs/robot0_joint_pos: no joint \w+ of robot h2017", [np.zeros((4, 7))], control_freq=20)
    wrong("demo_0: frame 0: .* is inf", [np.full((4, 6), np.inf)], control_freq=20)
    wrong("no demonstrations in /data", [], control_freq=20)
    wrong("rows of numbers are needed", [np.zeros(4)], control_freq=20)
    wrong("a frame lasts -1 s", paths, dt=-1)
    (tmp_path / "set.hdf5").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(8))
    refused(tmp_path, robot, "set.hdf5: can't be read")
    (tmp_path / "other.hdf5").touch()
    refused(tmp_path, robot, "2 files .* would be right")
    refused(tmp_path / "nowhere", robot, "0 files .* would be right")


def test_a_duration_and_a_feature_may_be_named(robot: Robot, paths: list[FloatArray], tmp_path: Path) -> None:
    file = robomimic(tmp_path / "set.hdf5", paths, "arm")
    read: RecordedSet = read_set(file, robot, "arm", 0.1)
    assert (read.dt, len(read.episodes)) == (0.1, 11)
