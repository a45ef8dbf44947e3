"""A vendor's URDF as it is written: links and joints, with nothing refused that can be decided later."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from plancurate.errors import PlancurateError
from plancurate.robots.adding.findings import Findings
from plancurate.robots.shapes import FloatArray
from plancurate.robots.urdf_values import numbers, origin_of

TURNING = ("revolute", "continuous")
MOVING = (*TURNING, "prismatic")
KNOWN = (*MOVING, "fixed", "floating", "planar")
LIMITS = ("lower", "upper", "velocity", "effort")
NO_LIMITS: dict[str, float] = {}
SOFT = ("soft_lower_limit", "soft_upper_limit")
EXPAND = "a .xacro file must be expanded first: xacro FILE > robot.urdf"


@dataclass(frozen=True)
class Mimic:
    """A joint's position as `multiplier` times that of `joint`, plus `offset`."""

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True, eq=False)
class SourceJoint:
    """A joint: `origin` (4,4) child to parent frame at zero, unit `axis` (3,); `limit` holds the file's numbers."""

    name: str
    type: str
    parent: str
    child: str
    origin: FloatArray
    axis: FloatArray
    limit: dict[str, float]
    mimic: Mimic | None

    @property
    def moves(self) -> bool:
        """Whether it can move at all."""
        return self.type in MOVING


@dataclass(frozen=True, eq=False)
class Source:
    """The file's links by name and joints by name, in its order."""

    file: Path
    links: dict[str, ET.Element]
    joints: dict[str, SourceJoint]

    @property
    def root(self) -> str:
        """The base: the one link without a parent."""
        children = {joint.child for joint in self.joints.values()}
        return next(link for link in self.links if link not in children)

    @property
    def parents(self) -> dict[str, SourceJoint]:
        """The joint above each link but the root."""
        return {joint.child: joint for joint in self.joints.values()}


def read_source(file: Path, findings: Findings) -> Source:
    """Parse `file`; PlancurateError where it is no URDF or no tree, other problems go to `findings`."""
    try:
        root = ET.parse(file).getroot()
    except (OSError, ET.ParseError) as error:
        hint = f"; {EXPAND}" if file.suffix == ".xacro" else ""
        raise PlancurateError(f"{file}: not a readable URDF: {error}{hint}") from None
    if root.tag != "robot":
        raise PlancurateError(f"{file}: the root element is <{root.tag}>; a URDF starts with <robot>")
    links = {element.get("name", ""): element for element in root.findall("link")}
    if not links:
        raise PlancurateError(f"{file}: <robot> has no <link>; {EXPAND}")
    elements = [element for element in root.findall("joint") if element.find("parent") is not None]
    joints = {element.get("name", ""): _joint(element, findings) for element in elements}
    findings.problems += [
        f"the name '{name}' is given to {count} links or joints; each needs its own"
        for kind in (root.findall("link"), elements)
        for name, count in Counter(element.get("name", "") for element in kind).items()
        if count > 1
    ]
    source = Source(file, links, joints)
    _require_tree(source)
    return source


def _joint(element: ET.Element, findings: Findings) -> SourceJoint:
    name, kind = element.get("name", ""), element.get("type", "")
    where = f"joint '{name}'"
    if kind not in KNOWN:
        findings.problems.append(f"{where}: type '{kind}' is none of URDF's; use {', '.join(KNOWN)}")
    return SourceJoint(
        name=name,
        type=kind,
        parent=_end(element, "parent"),
        child=_end(element, "child"),
        origin=findings.attempt(lambda: origin_of(where, element), np.eye(4)),
        axis=findings.attempt(lambda: _axis(where, element), np.array([1.0, 0.0, 0.0])),
        limit=findings.attempt(lambda: _limits(where, element), NO_LIMITS),
        mimic=findings.attempt(lambda: _mimic(where, element.find("mimic")), None),
    )


def _limits(where: str, element: ET.Element) -> dict[str, float]:
    return _numbers(where, element.find("limit"), LIMITS) | _numbers(
        where, element.find("safety_controller"), SOFT
    )


def _end(element: ET.Element, tag: str) -> str:
    end = element.find(tag)
    return "" if end is None else end.get("link", "")


def _axis(where: str, element: ET.Element) -> FloatArray:
    """The unit axis of a joint that moves; along x, which nothing uses, for one that does not."""
    axis = element.find("axis")
    if axis is None or element.get("type") not in MOVING:
        return np.array([1.0, 0.0, 0.0])
    direction = np.array(numbers(where, axis, "xyz", 3))
    length = float(np.linalg.norm(direction))
    if length == 0.0:
        raise PlancurateError(f"{where}: axis 0 0 0 has no direction; give a unit vector")
    return np.asarray(direction / length)


def _numbers(where: str, element: ET.Element | None, names: Iterable[str]) -> dict[str, float]:
    """Those of the element's attributes that are there, as numbers."""
    if element is None:
        return {}
    return {name: numbers(where, element, name, 1)[0] for name in names if name in element.attrib}


def _mimic(where: str, element: ET.Element | None) -> Mimic | None:
    if element is None:
        return None
    found = _numbers(where, element, ("multiplier", "offset"))
    return Mimic(element.get("joint", ""), found.get("multiplier", 1.0), found.get("offset", 0.0))


def _require_tree(source: Source) -> None:
    """Every joint joins two links of the file, every link has one parent, and one link has none."""
    above: dict[str, str] = {}
    for joint in source.joints.values():
        for end in (joint.parent, joint.child):
            if end not in source.links:
                raise PlancurateError(f"{source.file}: joint '{joint.name}': link '{end}' does not exist")
        if joint.child in above:
            raise PlancurateError(
                f"{source.file}: link '{joint.child}' is the child of '{above[joint.child]}' and '{joint.name}';"
                " closed loops are not supported, leave one of the joints out"
            )
        above[joint.child] = joint.name
    roots = [link for link in source.links if link not in above]
    if len(roots) != 1:
        found = ", ".join(roots) or "none"
        raise PlancurateError(
            f"{source.file}: exactly one link must have no parent (the base); found {found}"
        )
