import numpy as np
import pytest

from plancurate import native
from plancurate.robots import load_robot, load_scene
from plancurate.robots.adding.homes import choose_home
from plancurate.robots.scene_loading import scenes_from_home

ROBOT, FLOOR = load_robot("xarm6"), load_scene("free")


def ball_at(place, tmp_path):
    """A scene with a ball there, m."""
    file = tmp_path / "ball.yaml"
    centre = ", ".join(f"{value:.6f}" for value in place)
    file.write_text(
        "ground: 0.0\nmargin: 0.005\nshapes:\n"
        f"  - {{ name: ball, kind: sphere, radius: 0.05, xyz: [{centre}] }}\n"
    )
    return load_scene(file, ROBOT)


def test_home_is_one_that_is_free_in_the_scenes_that_start_from_it(tmp_path):
    calmest = choose_home(ROBOT, FLOOR, [])
    elbow = native.joint_frames(ROBOT.native, calmest[None])[0, 2, :3, 3]
    scene = ball_at(elbow, tmp_path)
    assert not native.is_free(ROBOT.native, scene.native, calmest[None])[0]
    other = choose_home(ROBOT, FLOOR, [FLOOR, scene])
    assert native.is_free(ROBOT.native, scene.native, other[None])[0]


@pytest.mark.slow
def test_where_no_home_is_free_everywhere_it_is_the_one_for_the_floor(tmp_path):
    blocked = ball_at(native.joint_frames(ROBOT.native, ROBOT.home[None])[0, 1, :3, 3], tmp_path)
    np.testing.assert_array_equal(choose_home(ROBOT, FLOOR, [blocked]), choose_home(ROBOT, FLOOR, []))


def test_scenes_with_a_start_of_their_own_ask_nothing_of_home():
    assert {scene.name for scene in scenes_from_home(ROBOT)} == {"free", "table"}
