from __future__ import annotations

import json

import numpy as np
import pytest

from plancurate.flows.cli.app import main
from plancurate.robots import load_robot
from plancurate.tasks.lake.schema import table
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.motion.motion import Motion
from plancurate.tasks.motion.trajectory_files import write_motion

from ..lakes import POOL, trajectory


@pytest.fixture
def motion():
    robot = load_robot("h2017")
    t = np.linspace(0, 2, 41)
    s = (t / 2)[:, None]
    way = (10 * s**3 - 15 * s**4 + 6 * s**5) * np.array([0.5, 0, 0, 0, 0, 0.5])
    return Motion(t, robot.home + way, joint_names=robot.joint_names)


def ended(*words):
    with pytest.raises(SystemExit) as end:
        main(["verify", *map(str, words)])
    return end.value.code


def test_exit_code_text_json_and_picture_say_the_same(motion, tmp_path, capsys):
    good, bad, picture = tmp_path / "good.csv", tmp_path / "bad.json", tmp_path / "picture.png"
    write_motion(good, motion)
    write_motion(bad, Motion(motion.times / 3, motion.positions, joint_names=motion.joint_names))
    assert ended(good) == 0
    assert capsys.readouterr().out.startswith("PASS\n")
    assert ended(bad, "--plot", picture) == 1
    assert capsys.readouterr().out.startswith("FAIL: joint_1 exceeds its acceleration limit")
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert ended(bad, "--json") == 1
    found = json.loads(capsys.readouterr().out)
    assert (found["passed"], found["first"]["check"], found["first"]["where"]) == (
        False,
        "acceleration",
        "joint_1",
    )
    assert found["first"]["worst"] > 1.2 * found["first"]["limit"]


def test_the_payload_counts(motion, tmp_path, capsys):
    file = tmp_path / "motion.npz"
    write_motion(file, motion)
    assert ended(file, "--payload-mass", 5) == 0
    assert ended(file, "--payload-mass", 60, "--payload-centre", 0, 0, 0.2) == 1
    assert "torque limit" in capsys.readouterr().out


def test_what_can_t_be_used_ends_with_2_and_one_line(motion, tmp_path, capsys):
    file = tmp_path / "motion.csv"
    write_motion(file, motion)
    for words, said in (
        ([tmp_path / "absent.csv"], "no such file"),
        ([], "a file, --lake"),
        ([file, "--study", "smoke"], "one of them"),
        (["--study", "smoke"], "--study needs --target X Y Z"),
        ([file, "--robot", "h2018"], "unknown robot 'h2018'"),
        ([file, "--payload-mass", -1], "--payload-mass = -1"),
        ([file, "--plot", tmp_path / "picture.jpg"], "must end with .png"),
    ):
        assert ended(*words) == 2
        error = capsys.readouterr().err
        assert said in error
        assert error.count("\n") == 1


def test_a_picture_is_made_of_what_can_t_be_read_as_a_motion_too(motion, tmp_path):
    file, picture = tmp_path / "motion.csv", tmp_path / "picture.png"
    q = motion.positions.copy()
    q[3, 1] = np.nan
    write_motion(file, Motion(motion.times, q, joint_names=motion.joint_names))
    assert ended(file, "--plot", picture) == 1
    assert picture.stat().st_size > 10_000


def test_a_trajectory_of_the_lake_is_verified_in_its_own_world(motion, tmp_path, capsys):
    import pyarrow as pa

    lake = Lake(tmp_path / "home" / "lake")
    rows = [
        trajectory(0, "RRT", 0, q=motion.positions.tolist(), n_waypoints=41),
        trajectory(0, "RRT", 1, q=[], solved=False, verified=False, reason="no path", status="none"),
    ]
    part = pa.Table.from_pylist(rows, table("trajectories").schema)
    lake.write("trajectories", {**POOL, "scene": "table", "planner": "RRT"}, "000000", part, {})
    home = ("--home", tmp_path / "home")
    assert ended("--lake", rows[0]["trajectory_id"], *home) == 0
    assert ended("--lake", rows[1]["trajectory_id"], *home) == 2
    assert "the run failed: no path" in capsys.readouterr().err
    assert ended("--lake", "nothing", *home) == 2
    assert "no trajectory 'nothing'" in capsys.readouterr().err
