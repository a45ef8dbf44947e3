import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh

from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.robots import load_robot, load_world
from plancurate.robots.adding import refining
from plancurate.robots.adding.add import Request, add_robot
from plancurate.robots.adding.check import check_robot
from plancurate.robots.adding.findings import Findings
from plancurate.robots.adding.quality import depth
from plancurate.robots.adding.solids import read_solids
from plancurate.robots.adding.source import read_source
from plancurate.robots.adding.surroundings import surroundings
from plancurate.robots.urdf import read_urdf
from plancurate.tasks.candidates.settings import TargetSettings
from plancurate.tasks.candidates.targets import sample_targets

from .vendors import five_joint_arm, gripper_arm


@pytest.fixture(params=["five", "gripper"])
def added(request):
    return request.getfixturevalue(request.param)


@pytest.mark.slow
def test_every_corner_of_every_mesh_lies_in_one_of_its_links_shapes(added):
    urdf = next(added.folder.parents[1].rglob(f"{added.folder.name}.urdf"))
    solids = read_solids(read_source(urdf, Findings()), (), Findings())
    own = read_urdf(added.folder / "robot.urdf").links
    meshed = [link for link, solid in solids.items() if len(solid.triangles)]
    assert len(meshed) == added.robot.dof + 1
    for link in meshed:
        corners = solids[link].triangles.reshape(-1, 3)
        assert np.max([depth(shape, corners) for shape in own[link].shapes], axis=0).min() > 0
        assert np.ptp(corners[:, 2]) == pytest.approx(0.18)  # millimetres became metres


def test_links_with_the_same_mesh_are_fitted_once(monkeypatch):
    fitted = []
    monkeypatch.setattr(refining, "fit", lambda triangles, most, room: fitted.append(triangles) or (most,))
    box = trimesh.creation.box((0.1, 0.1, 0.2)).triangles
    rooms, shapes = refining.fitted_alone({"left": box, "right": box.copy(), "palm": 2 * box}, 3)
    assert len(fitted) == 2
    assert shapes == {"left": (3,), "right": (3,), "palm": (3,)}
    np.testing.assert_array_equal(rooms["left"].points, surroundings(box).points)
    assert rooms["left"] is rooms["right"]
    assert rooms["palm"] is not rooms["left"]


def test_home_has_the_tool_in_front_and_a_whole_wrist_points_it_down(added, gripper):
    tool = native.fk(added.robot.native, added.robot.home[None])[0]
    assert 0.2 * added.robot.reach < tool[0, 3] < 0.7 * added.robot.reach
    if added is gripper:
        assert tool[2, 2] == pytest.approx(-1, abs=1e-3)


@pytest.mark.parametrize("scene", ["free", "table"])
def test_an_added_robot_reaches_targets(added, scene):
    settings = TargetSettings(orientation="any")
    robot, world = load_world(added.folder, scene)
    assert all(len(target.goals) for target in sample_targets(robot, world, settings, 0, 3))


def test_a_gripper_is_held_as_stated_and_what_mimics_it_follows(gripper):
    urdf = read_urdf(gripper.folder / "robot.urdf")
    at = {joint.name: joint for joint in urdf.joints}
    assert at["finger"].type == at["follower"].type == "fixed"
    np.testing.assert_allclose(at["finger"].origin[:3, 3], [0, 0.03, 0])
    np.testing.assert_allclose(at["follower"].origin[:3, 3], [0, -0.03, 0])
    assert gripper.robot.dof == 6


def test_an_endless_joint_gets_a_range_and_an_impossible_inertia_is_replaced_and_both_are_said(gripper):
    assert gripper.robot.upper[0] == pytest.approx(2 * np.pi, abs=1e-3)
    told = " ".join(gripper.notes)
    assert "'joint1' turns without end" in told
    assert "link 'left': its inertia is more" in told
    assert "link 'link1'" not in told


def test_the_folder_holds_what_says_where_it_is_from(five):
    assert {file.name for file in five.folder.iterdir()} == {
        "robot.urdf",
        "robot.yaml",
        "README.md",
        "fit.png",
    }
    assert "five.urdf" in (five.folder / "README.md").read_text()
    assert (five.folder / "fit.png").read_bytes().startswith(b"\x89PNG")
    assert list(five.folder.parent.iterdir()) == [five.folder]


def test_all_problems_are_told_at_once_and_nothing_is_written(tmp_path):
    urdf = gripper_arm(tmp_path)
    text = (
        urdf.read_text()
        .replace('velocity="2"', 'velocity="0"', 2)
        .replace("meshes/tube.obj", "package://p/tube.obj")
    )
    urdf.write_text(text)
    request = Request(urdf, "tol", "h2017", tmp_path / "robots", joints={"fingr": 0.1}, home=(0.0,))
    with pytest.raises(PlancurateError) as error:
        add_robot(request)
    for part in ("--name h2017", "did you mean finger", "did you mean tool", "--package-path"):
        assert part in str(error.value)
    assert not (tmp_path / "robots").exists()


@pytest.mark.parametrize(
    ("old", "new", "part"),
    [
        ('velocity="2"', 'velocity="0"', "--velocity VALUE"),
        ('effort="80"', "", "--effort VALUE"),
        ('lower="-2.4"', 'lower="2.5"', "must be below upper"),
        ("</joint>", '<mimic joint="joint2"/></joint>', "coupled motion"),
        ("tube.stl", "tube.step", "--package-path"),
        ('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>', "no direction"),
    ],
)
def test_a_problem_comes_with_its_remedy(tmp_path, old, new, part):
    urdf = five_joint_arm(tmp_path)
    text = urdf.read_text()
    place = text.index('name="joint3"') if "joint" in old else 0
    urdf.write_text(text[:place] + text[place:].replace(old, new))
    with pytest.raises(PlancurateError, match=part) as error:
        add_robot(Request(urdf, "tool", "five", tmp_path / "robots"))
    assert "\n" not in str(error.value)


def test_a_file_without_links_is_told_from_one_without_a_base(tmp_path):
    urdf = tmp_path / "ur3.urdf"
    urdf.write_text('<robot xmlns:xacro="http://wiki.ros.org/xacro"><xacro:ur3_robot prefix=""/></robot>')
    with pytest.raises(PlancurateError, match=r"has no <link>; a \.xacro file must be expanded"):
        read_source(urdf, Findings())


@pytest.mark.slow
def test_limits_that_are_left_out_can_be_given(tmp_path):
    urdf = five_joint_arm(tmp_path)
    urdf.write_text(urdf.read_text().replace('velocity="2"', "").replace('effort="80"', 'effort="0"'))
    home = (0.2, 0.4, 0.6, 0.8, 1.0)  # looking for one takes longer than the rest
    request = Request(
        urdf, "tool", "five", tmp_path / "robots", velocity=1.5, effort=70, home=home, shapes_a_link=1
    )
    robot = add_robot(request).robot
    assert robot.velocity.tolist() == [1.5] * 5
    assert robot.effort.tolist() == [70] * 5


@pytest.mark.slow
def test_an_srdf_switches_pairs_off_and_gives_a_home(tmp_path):
    srdf = tmp_path / "arm.srdf"
    joints = "".join(f'<joint name="joint{n}" value="{0.2 * n}"/>' for n in range(1, 6))
    srdf.write_text(
        '<robot name="arm"><disable_collisions link1="base" link2="link5" reason="Never"/>'
        f'<group_state name="home" group="arm">{joints}</group_state></robot>'
    )
    request = Request(
        five_joint_arm(tmp_path), "tool", "five", tmp_path / "robots", srdf=srdf, shapes_a_link=1
    )
    robot = add_robot(request).robot
    assert frozenset(("base", "link5")) in robot.allowed_contacts
    assert frozenset(("base", "link4")) not in robot.allowed_contacts
    np.testing.assert_allclose(robot.home, [0.2, 0.4, 0.6, 0.8, 1.0])


def test_check_measures_the_fit_again_and_refuses_shapes_that_no_longer_hold_the_mesh(five, tmp_path):
    urdf = next(five.folder.parents[1].rglob("five.urdf"))
    assert {fit.coverage for fit in check_robot(five.folder, urdf, ()).quality} == {1.0}
    spoilt = tmp_path / "five"
    shutil.copytree(five.folder, spoilt)
    text = (spoilt / "robot.urdf").read_text()
    radius = text.split('radius="')[1].split('"')[0]
    (spoilt / "robot.urdf").write_text(text.replace(f'radius="{radius}"', 'radius="0.035"'))
    with pytest.raises(PlancurateError, match=r"hold .* of the mesh"):
        check_robot(spoilt, urdf, ())


@pytest.mark.slow
@pytest.mark.parametrize("name", ["panda", "xarm6"])
def test_the_shipped_robots_load_and_say_where_they_are_from(name):
    robot = load_robot(name)
    assert "pybullet_data" in (Path(robot.urdf).parent / "README.md").read_text()
    assert not check_robot(name, None, ()).robot.scene_unchecked_links.isdisjoint({robot.shapes[0].link})
