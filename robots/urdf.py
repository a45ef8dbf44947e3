"""Read a URDF file into links and joints, refusing what the collision kernel or the physics cannot take."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from plancurate.errors import PlancurateError
from plancurate.robots.shapes import FloatArray, Shape
from plancurate.robots.urdf_values import numbers, origin_of, positive

MOVING_TYPES = ("revolute", "continuous", "prismatic")


@dataclass(frozen=True, eq=False)
class Link:
    """A rigid body: its collision shapes in the link frame and its mass in kg (None without <inertial>)."""

    name: str
    shapes: tuple[Shape, ...]
    mass: float | None


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint: `origin` (4,4) child to parent frame at zero, unit `axis` (3,) in the child frame; SI units.

    A fixed joint has no limits (zeros); a continuous one has infinite position limits.
    """

    name: str
    type: str
    parent: str
    child: str
    origin: FloatArray
    axis: FloatArray
    lower: float
    upper: float
    velocity: float
    effort: float


@dataclass(frozen=True, eq=False)
class Urdf:
    """The parsed file; `links` by name, `joints` in the order of the file."""

    file: Path
    links: dict[str, Link]
    joints: tuple[Joint, ...]


def read_urdf(file: Path) -> Urdf:
    """Parse `file`; PlancurateError names file, element and value of what is unsupported or missing."""
    try:
        root = ET.parse(file).getroot()
    except (OSError, ET.ParseError) as error:
        raise PlancurateError(f"{file}: not a readable URDF: {error}") from None
    if root.tag != "robot":
        raise PlancurateError(f"{file}: the root element is <{root.tag}>; a URDF starts with <robot>")
    links = {link.name: link for link in (_link(file, element) for element in root.findall("link"))}
    joints = tuple(_joint(file, element) for element in root.findall("joint"))
    for joint in joints:
        for end in (joint.parent, joint.child):
            if end not in links:
                raise PlancurateError(f"{file}: joint '{joint.name}': link '{end}' does not exist")
    return Urdf(file, links, joints)


def _link(file: Path, element: ET.Element) -> Link:
    name = element.get("name", "")
    where = f"{file}: link '{name}'"
    shapes = tuple(read_shape(where, collision) for collision in element.findall("collision"))
    mass = element.find("inertial/mass")
    return Link(name, shapes, None if mass is None else numbers(where, mass, "value", 1)[0])


def read_shape(where: str, collision: ET.Element) -> Shape:
    """The one primitive of a <collision>; PlancurateError starts with `where`."""
    geometry = collision.find("geometry")
    solids = [] if geometry is None else list(geometry)
    if len(solids) != 1:
        raise PlancurateError(f"{where}: <collision> needs one shape in its <geometry>, found {len(solids)}")
    solid, pose = solids[0], origin_of(where, collision)
    if solid.tag == "box":
        x, y, z = positive(where, solid, "size", 3)
        return Shape("box", (x / 2, y / 2, z / 2), pose)
    if solid.tag == "sphere":
        return Shape("sphere", (positive(where, solid, "radius", 1)[0], 0.0, 0.0), pose)
    if solid.tag == "capsule" or solid.tag == "cylinder":
        (radius,), (length,) = positive(where, solid, "radius", 1), positive(where, solid, "length", 1)
        return Shape("capsule" if solid.tag == "capsule" else "cylinder", (radius, length / 2, 0.0), pose)
    raise PlancurateError(
        f"{where}: collision shape <{solid.tag}> is not supported; use box, sphere, capsule or cylinder"
    )


def _joint(file: Path, element: ET.Element) -> Joint:
    name, kind = element.get("name", ""), element.get("type", "")
    where = f"{file}: joint '{name}'"
    if kind not in (*MOVING_TYPES, "fixed"):
        raise PlancurateError(
            f"{where}: type '{kind}' is not supported; use {', '.join(MOVING_TYPES)} or fixed"
        )
    if element.find("mimic") is not None:
        raise PlancurateError(
            f"{where}: <mimic> is not supported; make the joint fixed or give it its own motion"
        )
    lower, upper, velocity, effort = (0.0,) * 4 if kind == "fixed" else _limits(where, element, kind)
    return Joint(
        name=name,
        type=kind,
        parent=_end(where, element, "parent"),
        child=_end(where, element, "child"),
        origin=origin_of(where, element),
        axis=np.array([1.0, 0.0, 0.0]) if kind == "fixed" else _axis(where, element),
        lower=lower,
        upper=upper,
        velocity=velocity,
        effort=effort,
    )


def _end(where: str, element: ET.Element, tag: str) -> str:
    end = element.find(tag)
    if end is None or not end.get("link"):
        raise PlancurateError(f'{where}: <{tag} link="..."/> is missing')
    return end.get("link", "")


def _limits(where: str, element: ET.Element, kind: str) -> tuple[float, float, float, float]:
    limit = element.find("limit")
    if limit is None:
        raise PlancurateError(
            f"{where}: <limit> is missing; a {kind} joint needs effort and velocity, others a range too"
        )
    (velocity,), (effort,) = positive(where, limit, "velocity", 1), positive(where, limit, "effort", 1)
    if kind == "continuous":
        return -math.inf, math.inf, velocity, effort
    (lower,), (upper,) = numbers(where, limit, "lower", 1), numbers(where, limit, "upper", 1)
    if lower >= upper:
        raise PlancurateError(f"{where}: limit lower={lower:g} must be below upper={upper:g}")
    return lower, upper, velocity, effort


def _axis(where: str, element: ET.Element) -> FloatArray:
    axis = element.find("axis")
    direction = np.array(
        [1.0, 0.0, 0.0] if axis is None else numbers(where, axis, "xyz", 3)
    )  # the URDF default
    length = float(np.linalg.norm(direction))
    if length == 0.0:
        raise PlancurateError(f"{where}: axis 0 0 0 has no direction; give a unit vector")
    return np.asarray(direction / length, dtype=np.float64)
