from __future__ import annotations

import json
import pickle

import numpy as np
import pytest

from plancurate.errors import PlancurateError
from plancurate.tasks.motion.motion import Motion
from plancurate.tasks.motion.trajectory_files import FORMATS, read_motion, write_motion

T = np.array([0.0, 0.1, 0.25])
Q = np.array([[0.1, -2.0], [0.2, 1e-9], [0.3, 0.7]])
NAMES = ("a joint", "elbow")


@pytest.mark.parametrize("ending", FORMATS)
@pytest.mark.parametrize("derived", [(), ("velocities",), ("velocities", "accelerations")])
def test_what_is_written_is_read_again(ending, derived, tmp_path):
    motion = Motion(T, Q, joint_names=NAMES, **{name: Q * (2 + i) for i, name in enumerate(derived)})
    file = tmp_path / f"motion{ending}"
    write_motion(file, motion)
    again = read_motion(file)
    np.testing.assert_allclose(again.times, T, atol=1e-9)
    np.testing.assert_array_equal(again.positions, Q)
    if ending == ".npy":
        assert again.joint_names is None
        return
    assert again.joint_names == NAMES
    for name in ("velocities", "accelerations"):
        if name in derived:
            np.testing.assert_array_equal(getattr(again, name), getattr(motion, name))
        else:
            assert getattr(again, name) is None


def ros(**changes):
    point = {"positions": [1.0, 2.0], "time_from_start": {"sec": 1, "nanosec": 500_000_000}}
    return {"joint_names": ["a", "b"], "points": [point | changes]}


@pytest.mark.parametrize(
    "around", [lambda m: m, lambda m: {"trajectory": m}, lambda m: {"joint_trajectory": m}]
)
def test_messages_of_both_ros_versions_are_read(around, tmp_path):
    file = tmp_path / "message.json"
    for stamp, seconds in (({"sec": 1, "nanosec": 5}, 1 + 5e-9), ({"secs": 2, "nsecs": 0}, 2.0), (0.5, 0.5)):
        message = ros(time_from_start=stamp, effort=[])
        file.write_text(json.dumps(around(message | {"header": {"frame_id": "base"}})))
        found = read_motion(file)
        assert found.times.tolist() == [seconds]
        assert found.joint_names == ("a", "b")


def test_values_that_are_no_numbers_are_left_to_the_verifier(tmp_path):
    csv, yaml = tmp_path / "m.csv", tmp_path / "m.yaml"
    csv.write_text("time,a\n0,nan\n0.1,\n")
    assert np.isnan(read_motion(csv).positions).all()
    yaml.write_text("joint_names: [a]\npoints:\n- {positions: [.nan], time_from_start: 0.0}\n")
    assert np.isnan(read_motion(yaml).positions).all()


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("m.txt", "", "unknown ending '.txt'"),
        ("m.csv", "a,b\n1,2\n", "column 'time' is missing"),
        ("m.csv", "time,a\n0,x\n", "column 'a' holds no numbers"),
        ("m.csv", "time,a,a\n0,1,2\n", "column 'a' is there 2 times"),
        ("m.csv", "time,a,velocity:b\n0,1,2\n", "column 'velocity:a' is there 0 times"),
        ("m.csv", "", "not a CSV table"),
        ("m.parquet", "no", "not a Parquet table"),
        ("m.json", "{", "not valid JSON"),
        ("m.yaml", "- 1", "content"),
        ("m.json", json.dumps(ros(positions=[1.0])), "points.0.positions has 1 values"),
        ("m.json", json.dumps(ros(velocities=[1.0])), "points.0.velocities has 1 values"),
        ("m.json", json.dumps({"joint_names": ["a"], "points": []}), "points"),
        ("m.npy", "no", "not a NumPy file"),
    ],
)
def test_a_file_without_a_motion_says_what_would_be_right(name, content, said, tmp_path):
    file = tmp_path / name
    file.write_text(content)
    with pytest.raises(PlancurateError) as error:
        read_motion(file)
    assert str(file) in str(error.value)
    assert said in str(error.value)


def test_nothing_is_unpickled(tmp_path):
    file = tmp_path / "m.npy"
    file.write_bytes(pickle.dumps([1]))
    with pytest.raises(PlancurateError, match="not a NumPy file"):
        read_motion(file)
    np.save(file, np.array([{}], dtype=object), allow_pickle=True)
    with pytest.raises(PlancurateError, match="not a NumPy file"):
        read_motion(file)


def test_arrays_of_other_names_and_shapes_are_refused(tmp_path):
    file = tmp_path / "m.npz"
    for arrays, said in (
        ({"times": T}, "'positions' is missing"),
        ({"times": T, "positions": Q, "torques": Q}, "unknown array 'torques'"),
        ({"times": Q, "positions": Q}, r"times must be \(m,\)"),
        ({"times": T, "positions": np.array([["a"]])}, "numbers are needed"),
    ):
        np.savez(file, **arrays)
        with pytest.raises(PlancurateError, match=said):
            read_motion(file)
    with pytest.raises(PlancurateError, match="no such file"):
        read_motion(tmp_path / "absent.csv")
