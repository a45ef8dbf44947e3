"""URDFs as vendors write them, with meshes, made for tests."""

from __future__ import annotations

from pathlib import Path

import trimesh

LINK = """
  <link name="{name}"><inertial><origin xyz="0 0 {half}"/><mass value="2"/>
      <inertia ixx="{ixx}" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.004"/></inertial>
    <collision><origin xyz="0 0 {half}"/>
      <geometry><mesh filename="{mesh}" scale="0.001 0.001 0.001"/></geometry></collision>
  </link>"""
JOINT = """
  <joint name="{name}" type="{type}"><parent link="{parent}"/><child link="{child}"/>
    <origin xyz="0 0 {z}" rpy="0 0 0"/><axis xyz="{axis}"/>{limit}{mimic}</joint>"""
LIMIT = '<limit lower="{lower}" upper="{upper}" velocity="2" effort="80"/>'
FINGER = """
  <link name="{name}"><inertial><mass value="0.05"/>
      <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <collision><origin xyz="0 {y} 0.03"/><geometry><box size="0.02 0.01 0.06"/></geometry></collision></link>"""
AXES = ("0 0 1", "0 1 0", "0 1 0", "0 1 0", "0 0 1", "0 1 0")


def write_meshes(folder: Path, file: str = "tube.stl") -> None:
    """A tube in millimetres, as many vendors export."""
    folder.mkdir(parents=True, exist_ok=True)
    trimesh.creation.cylinder(radius=40, height=180, sections=16).export(folder / file)


def five_joint_arm(folder: Path) -> Path:
    """Five joints, meshes by `package://`, a fixed joint with axis 0 0 0, the first joint continuous."""
    write_meshes(folder / "arm_description" / "meshes")
    return _write(
        folder / "arm_description" / "urdf" / "five.urdf",
        _arm(5, "package://arm_description/meshes/tube.stl"),
    )


def gripper_arm(folder: Path) -> Path:
    """Six joints and a gripper whose second finger mimics the first; meshes beside the file, COLLADA and OBJ."""
    write_meshes(folder / "meshes", "tube.obj")
    write_meshes(folder / "meshes", "tube.dae")
    fingers = FINGER.format(name="left", y=0.005) + FINGER.format(name="right", y=-0.005)
    limit = LIMIT.format(lower=0, upper=0.04)
    fingers += JOINT.format(
        name="finger",
        type="prismatic",
        parent="tool",
        child="left",
        z=0.0,
        axis="0 1 0",
        limit=limit,
        mimic="",
    )
    mimic = '<mimic joint="finger" multiplier="-1" offset="0"/>'
    fingers += JOINT.format(
        name="follower", type="prismatic", parent="tool", child="right", z=0.0, axis="0 1 0",
        limit=LIMIT.format(lower=-0.04, upper=0), mimic=mimic,
    )  # fmt: skip
    text = _arm(6, "meshes/tube.obj").replace("tube.obj", "tube.dae", 2)
    return _write(folder / "gripper.urdf", text.replace("</robot>", fingers + "</robot>"))


def _arm(joints: int, mesh: str) -> str:
    text = '<robot name="arm">' + LINK.format(name="base", half=0.09, mesh=mesh, ixx=0.01)
    for number in range(joints):
        text += LINK.format(name=f"link{number + 1}", half=0.09, mesh=mesh, ixx=0.01)
        text += JOINT.format(
            name=f"joint{number + 1}",
            type="revolute" if number else "continuous",
            parent=f"link{number}" if number else "base",
            child=f"link{number + 1}",
            z=0.2,
            axis=AXES[number],
            limit=LIMIT.format(lower=-2.4, upper=2.4),
            mimic="",
        )
    text += '<link name="tool"><inertial><mass value="0"/></inertial></link>' + JOINT.format(
        name="flange",
        type="fixed",
        parent=f"link{joints}",
        child="tool",
        z=0.2,
        axis="0 0 0",
        limit="",
        mimic="",
    )
    return text + "</robot>"


def _write(file: Path, text: str) -> Path:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)
    return file
