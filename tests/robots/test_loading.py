import pickle
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from plancurate import native
from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.robots import colliding_pairs, load_robot, load_scene


def edited(tmp_path, folder, old, new, file="robot.urdf"):
    """A copy of a robot's folder in which every `old` in `file` is `new`."""
    copy = tmp_path / "edited"
    shutil.copytree(folder, copy)
    text = (copy / file).read_text()
    assert old in text
    (copy / file).write_text(text.replace(old, new))
    return copy


def assert_one_line(error, *parts):
    message = str(error.value)
    assert "\n" not in message
    for part in parts:
        assert part in message
    assert str(pickle.loads(pickle.dumps(error.value))) == message


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ('type="prismatic"', 'type="floating"', ["'spindle_joint'", "'floating'", "revolute"]),
        ('type="prismatic"', 'type="planar"', ["'planar'"]),
        (
            '<parent link="spindle"/>',
            '<mimic joint="inner_joint"/><parent link="spindle"/>',
            ["'hand_joint'", "<mimic>"],
        ),
        ('<sphere radius="0.03"/>', '<mesh filename="hand.stl"/>', ["'hand'", "<mesh>", "capsule"]),
        ('<sphere radius="0.03"/>', "", ["'hand'", "one shape"]),
        ('<sphere radius="0.03"/>', '<sphere radius="-1"/>', ["'hand'", "radius='-1'", "above zero"]),
        ('<sphere radius="0.03"/>', '<sphere radius="big"/>', ["'hand'", "radius='big'"]),
        ('<sphere radius="0.03"/>', "<sphere/>", ["'hand'", "no radius"]),
        ('parent link="outer"', 'parent link="post"', ["'inner_joint'", "'spindle_joint'", "branch"]),
        ('parent link="outer"', 'parent link="nowhere"', ["'spindle_joint'", "'nowhere'", "does not exist"]),
        ('child link="hand"', 'child link="inner"', ["'inner'", "'inner_joint'", "'hand_joint'"]),
        ('parent link="post"', 'parent link="hand"', ["loop"]),
        ("</robot>", '<link name="loose"/></robot>', ["no parent", "post, loose"]),
        ('lower="0" upper="0.2"', 'lower="0.3" upper="0.2"', ["'spindle_joint'", "lower=0.3"]),
        ('velocity="2" effort="150"', 'velocity="2"', ["no effort"]),
        ('<limit lower="0" upper="0.2" velocity="2" effort="150"/>', "", ["'spindle_joint'", "<limit>"]),
        ('lower="0" upper="0.2"', "", ["'spindle_joint'", "no lower"]),
        ('xyz="0 0 -1"', 'xyz="0 0 0"', ["'spindle_joint'", "axis"]),
        ('<mass value="1.5"/>', "", ["<inertial>"]),
        ("collision>", "visual>", ["no link", "<collision>"]),
        ('type="revolute"', 'type="fixed"', ["joints", "inner_joint"]),
        ("</robot>", "", ["not a readable URDF"]),
        ("robot", "machine", ["<machine>", "<robot>"]),
    ],
)
def test_a_urdf_that_cannot_be_taken_is_refused_in_one_line(tmp_path, robot_folders, old, new, parts):
    folder = edited(tmp_path, robot_folders["scara"], old, new)
    with pytest.raises(PlancurateError) as error:
        load_robot(folder)
    assert_one_line(error, *parts)


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ("tool_link: hand", "tool_link: hnad", ["tool_link", "'hnad'", "did you mean hand"]),
        ("tool_link: hand", "tool_link: outer", ["tool_link", "last joint", "hand"]),
        ("home: 0.9", "home: 3.0", ["outer_joint.home", "3", "[-2.6, 2.6]"]),
        ("home: 0.9", "home: .nan", ["outer_joint.home"]),
        ("home: 0.9", "home: right", ["outer_joint.home", "'right'"]),
        ("acceleration: 2,", "acceleration: 0,", ["spindle_joint.acceleration", "0"]),
        ("velocity: 0.5", "velocity: 5", ["spindle_joint.velocity", "5", "URDF's 2"]),
        ("velocity: 0.5", "position: [0, 2]", ["spindle_joint.position", "[0, 0.2]"]),
        ("velocity: 0.5", "position: [0.1, 0.1]", ["spindle_joint.position", "rise"]),
        ("velocity: 0.5", "speed: 0.5", ["spindle_joint.speed"]),
        ("outer_joint", "outter_joint", ["outter_joint", "outer_joint"]),
        ("  hand_joint: {acceleration: 8, home: 0}\n", "", ["hand_joint", "missing"]),
        ("[post]", "[pots]", ["scene_unchecked_links", "'pots'", "post"]),
        ("joints:", "allowed_contacts: [[hand, arm]]\njoints:", ["allowed_contacts", "'arm'"]),
        ("joints:", "allowed_contacts: [[hand, hand]]\njoints:", ["allowed_contacts", "different"]),
        ("urdf: robot.urdf", "urdf: other.urdf", ["other.urdf", "not a readable URDF"]),
        ("urdf: robot.urdf", "urdf: [", ["not valid YAML"]),
        ("urdf: robot.urdf\n", "", ["urdf"]),
    ],
)
def test_a_robot_yaml_that_cannot_be_taken_is_refused_in_one_line(tmp_path, robot_folders, old, new, parts):
    folder = edited(tmp_path, robot_folders["scara"], old, new, "robot.yaml")
    with pytest.raises(PlancurateError) as error:
        load_robot(folder)
    assert_one_line(error, str(folder), *parts)


def test_a_continuous_joint_without_a_range_to_plan_in_is_refused(tmp_path, robot_folders):
    folder = edited(tmp_path, robot_folders["seven"], ", position: [-3.0, 3.0]", "", "robot.yaml")
    with pytest.raises(PlancurateError, match=re.escape("joint_7.position")):
        load_robot(folder)


def test_a_home_in_self_collision_is_refused_and_the_links_named(tmp_path, robot_folders):
    folder = edited(tmp_path, robot_folders["seven"], "home: -1.0", "home: -2.75", "robot.yaml")
    with pytest.raises(PlancurateError) as error:
        load_robot(folder)
    assert_one_line(error, "at home", "link_", "touch")


def test_an_unknown_robot_or_scene_lists_the_near_names():
    with pytest.raises(UnknownNameError, match="h2017"):
        load_robot("h2071")
    with pytest.raises(UnknownNameError, match="table"):
        load_scene("tabel")


@pytest.mark.parametrize("load", [load_robot, load_scene])
def test_a_path_that_is_not_there_is_named(load, tmp_path):
    with pytest.raises(PlancurateError, match="nowhere"):
        load(tmp_path / "nowhere")


def test_a_folder_without_robot_yaml_is_refused(tmp_path):
    with pytest.raises(PlancurateError, match="cannot be read"):
        load_robot(tmp_path)


def test_a_folder_name_that_is_no_lake_name_is_refused(tmp_path):
    (tmp_path / "my robot=1").mkdir()
    with pytest.raises(PlancurateError, match="letters"):
        load_robot(tmp_path / "my robot=1")


def test_fixed_links_are_folded_in(robot_folders):
    robot = load_robot(robot_folders["seven"])
    assert robot.dof == 7
    assert robot.native.dof == 7
    camera = next(shape for shape in robot.shapes if shape.link == "camera")
    assert camera.frame == 5
    np.testing.assert_allclose(camera.shape.pose[:3, 3], [0.1, 0, 0.1])
    assert frozenset(("camera", "link_5")) in robot.allowed_contacts
    assert frozenset(("camera", "link_3")) not in robot.allowed_contacts


def test_a_prismatic_joint_slides(robot_folders):
    robot = load_robot(robot_folders["scara"])
    low, high = native.fk(robot.native, np.array([[0.1, 0.2, 0.2, 0.3], [0.1, 0.2, 0.0, 0.3]]))
    np.testing.assert_allclose(high[:3, 3] - low[:3, 3], [0, 0, 0.2], atol=1e-12)
    np.testing.assert_allclose(high[:3, :3], low[:3, :3], atol=1e-12)


@pytest.mark.parametrize(
    ("row", "parts"),
    [
        ("{name: a, kind: cone, xyz: [0, 0, 0]}", ["shapes.0", "cone", "box"]),
        ("{name: a, kind: sphere, radius: -1, xyz: [0, 0, 0]}", ["shapes.0", "radius", "-1"]),
        ("{name: a, kind: sphere, radius: 1}", ["shapes.0", "xyz"]),
        ("{name: a, kind: box, size: [1, 2], xyz: [0, 0, 0]}", ["shapes.0", "size"]),
        ("{name: a, kind: capsule, radius: 1, length: .inf, xyz: [0, 0, 0]}", ["length", "inf"]),
        ("{name: a, kind: sphere, radius: 1, colour: red, xyz: [0, 0, 0]}", ["colour", "red"]),
    ],
)
def test_a_scene_that_cannot_be_taken_is_refused_in_one_line(tmp_path, row, parts):
    file = tmp_path / "scene.yaml"
    file.write_text(f"ground: 0\nshapes:\n  - {row}\n")
    with pytest.raises(PlancurateError) as error:
        load_scene(file)
    assert_one_line(error, str(file), *parts)


def test_two_scene_shapes_of_one_name_are_refused(tmp_path):
    file = tmp_path / "scene.yaml"
    ball = "{name: ball, kind: sphere, radius: 1, xyz: [9, 0, 0]}"
    file.write_text(f"ground: 0\nshapes: [{ball}, {ball}]\n")
    with pytest.raises(PlancurateError, match="'ball' is given twice"):
        load_scene(file)


def test_touching_names_both_sides(tmp_path):
    robot = load_robot("h2017")
    file = tmp_path / "wall.yaml"
    file.write_text(
        "ground: 0\nshapes:\n  - {name: wall, kind: box, size: [0.1, 2, 3], xyz: [0.75, 0, 1.5]}\n"
    )
    found = colliding_pairs(robot, load_scene(file), robot.home)
    assert "link_6 and wall" in found
    assert all(name.endswith("and wall") for name in found)
    down = np.array([0.0, 1.6, 2.3, 0.0, 0.0, 0.0])
    assert "link_6 and ground" in colliding_pairs(robot, load_scene("free"), down)


def test_the_package_lists_what_it_ships():
    folder = Path(load_robot("h2017").urdf).parent
    assert (folder / "README.md").is_file()
