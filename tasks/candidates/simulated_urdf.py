"""The URDF that PyBullet is given: the robot's own, without what a simulation does not need."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from functools import lru_cache
from pathlib import Path

from plancurate.tasks.candidates.payload import Payload

PAYLOAD = "plancurate_payload"


@lru_cache
def simulated_urdf(file: Path, digest: str, tool_link: str, payload: Payload | None, solid: bool) -> bytes:
    """The URDF without visuals; a link without inertia weighs nothing (PyBullet would take 1 kg and say so).

    A payload is a link of its own, a point mass fixed to the tool. Links that are not `solid` have no collision
    shapes; what they weigh stands in the file, so they move alike. `digest` is there for the cache: another content of
    the file is another entry.
    """
    tree = ET.parse(file).getroot()
    for link in tree.findall("link"):
        for shape in link.findall("visual") + ([] if solid else link.findall("collision")):
            link.remove(shape)
        if link.find("inertial") is None:
            _add_mass(link, 0.0)
    if payload is not None:
        _add_payload(tree, tool_link, payload)
    return ET.tostring(tree)


def _add_payload(tree: ET.Element, tool_link: str, payload: Payload) -> None:
    _add_mass(ET.SubElement(tree, "link", name=PAYLOAD), payload.mass_kg)
    joint = ET.SubElement(tree, "joint", name=f"{PAYLOAD}_mount", type="fixed")
    ET.SubElement(joint, "parent", link=tool_link)
    ET.SubElement(joint, "child", link=PAYLOAD)
    ET.SubElement(joint, "origin", xyz=" ".join(map(str, payload.centre_m)), rpy="0 0 0")


def _add_mass(link: ET.Element, mass: float) -> None:
    """Give a link a point mass at its origin."""
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "mass", value=str(mass))
    ET.SubElement(inertial, "inertia", ixx="0", ixy="0", ixz="0", iyy="0", iyz="0", izz="0")
