"""Pictures show what kinematics says, and nothing is written for what can't be shown."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import PIL.Image
import pytest

from plancurate.flows.cli.app import main
from plancurate.robots import load_world
from plancurate.tasks.motion.motion import Motion
from plancurate.tasks.motion.trajectory_files import write_motion
from plancurate.tasks.pictures.drawing import Dot
from plancurate.tasks.pictures.film import Stage
from plancurate.tasks.pictures.shot import Shot, motion_run
from plancurate.tasks.pictures.solids import tool_path


def motion(robot, turn):
    t = np.linspace(0, 2, 41)
    s = (t / 2)[:, None]
    way = (10 * s**3 - 15 * s**4 + 6 * s**5) * np.array(turn)
    return Motion(t, robot.home + way, joint_names=robot.joint_names)


AROUND, INTO_THE_POST = [0.9, 0.1, 0.1, 0, 0, 0.5], [-0.9, 0.6, 0.3, 0, 0, 0.5]


@pytest.mark.slow
def test_a_dot_at_the_tool_is_where_the_camera_projects_it():
    robot, scene = load_world("h2017", "free")
    q = robot.home + np.array([0.5, -0.3, 0, 0, 0, 0])
    (tool,) = tool_path(robot, q[None])
    stage = Stage(Shot(robot, scene, dots=(Dot(tool, "#d6006c", 4.0),)), (320, 240))
    image = stage.image(q, (), "")
    (x, y), *_ = stage.camera.project(tool[None])[0].astype(int)
    assert image.shape == (240, 320, 3)
    red, green, blue = image[y, x].astype(int)
    assert red > green + 60
    bare = Stage(Shot(robot, scene), (320, 240))
    solid = bare.image(q, (), "")[
        tuple(bare.camera.project(tool[None] - [0, 0, -0.05])[0][0].astype(int)[::-1])
    ]
    assert blue > green  # the dot's colour, seen through the flange or before it
    assert solid.max() < 200  # the arm's dark last link, not the pale floor


@pytest.mark.slow
def test_a_motion_into_an_obstacle_ends_there_in_red():
    robot, scene = load_world("h2017", "table")
    clear, blocked = (motion_run(robot, scene, motion(robot, turn)) for turn in (AROUND, INTO_THE_POST))
    assert (clear.times[-1], clear.touching) == (2.0, frozenset())
    assert "post" in blocked.touching
    assert blocked.times[-1] < 1

    def red(run):
        image = Stage(Shot(robot, scene, (run,)), (320, 240)).moment(run.times[-1]).astype(int)
        return int(((image[..., 0] > 110) & (image[..., 1] < 60)).sum())

    assert red(clear) == 0
    assert red(blocked) > 200


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["png", "gif", "mp4", "rrd"])
def test_a_file_of_each_kind_opens(ending, tmp_path):
    robot, _ = load_world("h2017", "table")
    file, out = tmp_path / "motion.csv", tmp_path / f"out.{ending}"
    write_motion(file, motion(robot, INTO_THE_POST))
    words = ("--scene", "table", "--width", "160", "--out", str(out))
    assert run("trajectory", str(file), *words) == 0
    assert sorted(tmp_path.iterdir()) == [file, out]
    if ending in ("png", "gif"):
        with PIL.Image.open(out) as image:
            assert image.size == (160, 120)
            frames = getattr(image, "n_frames", 1)
            assert frames == 1 if ending == "png" else frames > 4
    elif ending == "mp4":
        assert out.read_bytes()[4:8] == b"ftyp"
    else:
        done = subprocess.run(
            [sys.executable, "-m", "rerun", "rrd", "verify", str(out)], capture_output=True, check=False
        )
        assert done.returncode == 0, done.stderr


def run(*words):
    try:
        main(["show", *words])
    except SystemExit as end:
        return end.code or 0
    return 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["scene", "tabel", "--out", "x.png"], "table"),
        (["scene", "table", "--out", "x.jpg"], "unknown ending '.jpg'"),
        (["scene", "table", "--out", "x.png", "--width", "1"], "--width = 1"),
        (["robot", "h2071", "--out", "x.png"], "h2017"),
        (["trajectory", "nothing", "--out", "x.gif"], "no lake at"),
        (["selection", "nothing", "--out", "x.png"], "no lake at"),
        (["ways", "--study", "nothing", "--out", "x.gif"], "no lake at"),
        (["rollout", "--study", "nothing", "--out", "x.gif"], "no lake at"),
        (["scene", "table", "--out", "absent/x.png"], "there is no folder"),
    ],
)
def test_what_can_t_be_shown_ends_with_2_and_one_line(words, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("PLANCURATE_HOME", raising=False)
    assert run(*words) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())
