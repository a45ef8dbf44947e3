"""Write an added robot's URDF and robot.yaml."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence

import numpy as np

from plancurate.robots.adding.folding import Folded
from plancurate.robots.adding.inertias import Inertial
from plancurate.robots.adding.planning_limits import MovingJoint
from plancurate.robots.adding.source import Source
from plancurate.robots.robot_file import RobotFile
from plancurate.robots.shapes import FloatArray, Shape


def urdf_text(
    name: str,
    source: Source,
    folded: Folded,
    limits: Sequence[MovingJoint],
    shapes: Mapping[str, Sequence[Shape]],
    inertials: Mapping[str, Inertial],
) -> str:
    """The robot's URDF: the vendor's links and joints, primitive shapes, held joints fixed."""
    root = ET.Element("robot", name=name)
    for link in source.links:
        element = ET.SubElement(root, "link", name=link)
        if link in inertials:
            _write_inertial(element, inertials[link])
        for shape in shapes[link]:
            _write_shape(element, shape)
    moving = {joint.source.name: joint for joint in limits}
    for joint in source.joints.values():
        kind = joint.type if joint.name in moving else "fixed"
        element = ET.SubElement(root, "joint", name=joint.name, type=kind)
        ET.SubElement(element, "parent", link=joint.parent)
        ET.SubElement(element, "child", link=joint.child)
        _write_origin(element, folded.origin(joint))
        if joint.name in moving:
            ET.SubElement(element, "axis", xyz=_text(joint.axis))
            _write_limit(element, moving[joint.name])
    ET.indent(root)
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _write_inertial(link: ET.Element, inertial: Inertial) -> None:
    element = ET.SubElement(link, "inertial")
    _write_origin(element, inertial.pose)
    ET.SubElement(element, "mass", value=_text([inertial.mass]))
    i = inertial.inertia
    six = {"ixx": i[0, 0], "ixy": i[0, 1], "ixz": i[0, 2], "iyy": i[1, 1], "iyz": i[1, 2], "izz": i[2, 2]}
    ET.SubElement(element, "inertia", {key: _text([value]) for key, value in six.items()})


def _write_shape(link: ET.Element, shape: Shape) -> None:
    element = ET.SubElement(link, "collision")
    _write_origin(element, shape.pose)
    geometry = ET.SubElement(element, "geometry")
    a, b, c = shape.size
    if shape.kind == "box":
        ET.SubElement(geometry, "box", size=_text([2 * a, 2 * b, 2 * c]))
    elif shape.kind == "sphere":
        ET.SubElement(geometry, "sphere", radius=_text([a]))
    else:
        ET.SubElement(geometry, shape.kind, radius=_text([a]), length=_text([2 * b]))


def _write_origin(element: ET.Element, pose: FloatArray) -> None:
    ET.SubElement(element, "origin", xyz=_text(pose[:3, 3]), rpy=_text(roll_pitch_yaw(pose[:3, :3])))


def _write_limit(element: ET.Element, joint: MovingJoint) -> None:
    values = {"velocity": _text([joint.velocity]), "effort": _text([joint.effort])}
    if joint.source.type != "continuous":
        values |= {"lower": _text([joint.lower]), "upper": _text([joint.upper])}
    ET.SubElement(element, "limit", values)


def roll_pitch_yaw(rotation: FloatArray) -> FloatArray:
    """Angles (3,) about fixed x, y, z of a rotation (3,3); a pitch of a quarter turn has no yaw."""
    level = math.hypot(rotation[0, 0], rotation[1, 0])
    pitch = math.atan2(-rotation[2, 0], level)
    if level < 1e-9:
        return np.array([math.atan2(-rotation[1, 2], rotation[1, 1]), pitch, 0.0])
    roll, yaw = math.atan2(rotation[2, 1], rotation[2, 2]), math.atan2(rotation[1, 0], rotation[0, 0])
    return np.array([roll, pitch, yaw])


def _text(values: Sequence[float] | FloatArray) -> str:
    return " ".join(f"{value + 0.0:.12g}" for value in np.where(np.abs(values) < 1e-12, 0.0, values))


def yaml_text(content: RobotFile, title: str) -> str:
    """The robot.yaml that holds `content`."""
    lines = [f"# {title}: what plans keep to, rad (m) and s; README.md says where each number comes from."]
    lines += [f"urdf: {content.urdf}", f"tool_link: {content.tool_link}", "", "joints:"]
    for name, entry in content.joints.items():
        low, high = entry.position or (0.0, 0.0)
        lines.append(
            f"  {name}: {{ position: [{low:.12g}, {high:.12g}], velocity: {entry.velocity:.12g},"
            f" acceleration: {entry.acceleration:.12g}, home: {entry.home + 0.0:.12g} }}"
        )
    if content.allowed_contacts:
        lines += [
            "",
            "allowed_contacts:",
            *(f"  - [{first}, {second}]" for first, second in content.allowed_contacts),
        ]
    if content.scene_unchecked_links:
        lines += ["", f"scene_unchecked_links: [{', '.join(content.scene_unchecked_links)}]"]
    return "\n".join(lines) + "\n"
