"""Two robots that are unlike the H2017, as folders of a URDF and a YAML file."""

from __future__ import annotations

from pathlib import Path

import pytest

LINK = """
  <link name="{name}">
    <inertial><origin xyz="{com}"/><mass value="{mass}"/>
      <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial>
    <collision><origin xyz="{com}"/><geometry>{shape}</geometry></collision>
  </link>"""
JOINT = """
  <joint name="{name}" type="{type}"><parent link="{parent}"/><child link="{child}"/>
    <origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>
    <limit lower="{lower}" upper="{upper}" velocity="2" effort="150"/></joint>"""
FIXED = """
  <joint name="{name}" type="fixed"><parent link="{parent}"/><child link="{child}"/>
    <origin xyz="{xyz}" rpy="{rpy}"/></joint>"""


def seven_joint_urdf() -> str:
    """Seven joints, the last continuous, a camera fixed to the side and a tool frame without mass."""
    shapes = [
        '<capsule radius="0.06" length="0.14"/>',
        '<box size="0.1 0.1 0.24"/>',
        '<cylinder radius="0.05" length="0.2"/>',
    ]
    text = '<robot name="seven"><link name="world"/>' + LINK.format(
        name="link_0", com="0 0 0.05", mass=3, shape='<cylinder radius="0.09" length="0.1"/>'
    )
    text += FIXED.format(name="foot", parent="world", child="link_0", xyz="0 0 0", rpy="0 0 0")
    for i in range(1, 8):
        text += LINK.format(name=f"link_{i}", com="0 0 0.11", mass=8 - i, shape=shapes[i % 3])
        text += JOINT.format(
            name=f"joint_{i}",
            type="continuous" if i == 7 else "revolute",
            parent=f"link_{i - 1}",
            child=f"link_{i}",
            xyz="0 0 0.1" if i == 1 else "0 0 0.22",
            rpy="0 0 0.3" if i == 4 else "0 0 0",
            axis="0 0 1" if i % 2 else "0 1 0",
            lower=-2.8,
            upper=2.8,
        )
    text += LINK.format(name="camera", com="0 0 0", mass=0.2, shape='<sphere radius="0.04"/>')
    text += FIXED.format(name="mount", parent="link_5", child="camera", xyz="0.1 0 0.1", rpy="0 0 0")
    text += '<link name="tool"/>'
    text += FIXED.format(name="flange", parent="link_7", child="tool", xyz="0.02 0 0.15", rpy="0 0.4 0")
    return text + "</robot>"


def scara_urdf() -> str:
    """Two swinging links, a sliding spindle and a turn of two rounds."""
    text = '<robot name="scara">' + LINK.format(
        name="post", com="0 0 0.2", mass=5, shape='<box size="0.12 0.12 0.4"/>'
    )
    rows = [
        (
            "inner",
            "revolute",
            "post",
            "0 0 0.45",
            "0 0 1",
            -2.5,
            2.5,
            "0.15 0 0",
            '<box size="0.3 0.1 0.06"/>',
        ),
        (
            "outer",
            "revolute",
            "inner",
            "0.3 0 0",
            "0 0 1",
            -2.6,
            2.6,
            "0.12 0 0",
            '<box size="0.2 0.08 0.05"/>',
        ),
        (
            "spindle",
            "prismatic",
            "outer",
            "0.25 0 0",
            "0 0 -1",
            0,
            0.2,
            "0 0 0",
            '<capsule radius="0.02" length="0.2"/>',
        ),
        (
            "hand",
            "revolute",
            "spindle",
            "0 0 -0.12",
            "0 0 1",
            -6.28,
            6.28,
            "0 0 -0.02",
            '<sphere radius="0.03"/>',
        ),
    ]
    for child, kind, parent, xyz, axis, lower, upper, com, shape in rows:
        text += LINK.format(name=child, com=com, mass=1.5, shape=shape)
        text += JOINT.format(
            name=f"{child}_joint", type=kind, parent=parent, child=child, xyz=xyz, rpy="0 0 0", axis=axis,
            lower=lower, upper=upper,
        )  # fmt: skip
    return text + "</robot>"


SEVEN_YAML = """urdf: robot.urdf
tool_link: tool
scene_unchecked_links: [link_0]
allowed_contacts: [[link_4, camera], [camera, link_7]]
joints:
  joint_1: {acceleration: 3, home: 0}
  joint_2: {acceleration: 3, home: 0.6}
  joint_3: {acceleration: 3, home: 0}
  joint_4: {acceleration: 3, home: -1.0}
  joint_5: {acceleration: 3, home: 0}
  joint_6: {acceleration: 3, home: 0.7}
  joint_7: {acceleration: 3, home: 0, position: [-3.0, 3.0]}
"""
SCARA_YAML = """urdf: robot.urdf
tool_link: hand
scene_unchecked_links: [post]
joints:
  inner_joint: {acceleration: 4, home: 0.4}
  outer_joint: {acceleration: 4, home: 0.9}
  spindle_joint: {velocity: 0.5, acceleration: 2, home: 0.05}
  hand_joint: {acceleration: 8, home: 0}
"""


def write_robot(folder: Path, urdf: str, yaml: str) -> Path:
    """Write a robot's two files into a new folder."""
    folder.mkdir()
    (folder / "robot.urdf").write_text(urdf)
    (folder / "robot.yaml").write_text(yaml)
    return folder


@pytest.fixture(scope="session")
def robot_folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Folders of two robots that are unlike the H2017."""
    root = tmp_path_factory.mktemp("robots")
    return {
        "seven": write_robot(root / "seven", seven_joint_urdf(), SEVEN_YAML),
        "scara": write_robot(root / "scara", scara_urdf(), SCARA_YAML),
    }
