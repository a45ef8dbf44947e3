"""Fold a URDF's tree into a serial chain of moving frames, with every link rigid in one of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from plancurate.errors import PlancurateError
from plancurate.robots.shapes import FloatArray
from plancurate.robots.urdf import Joint, Urdf


@dataclass(frozen=True, eq=False)
class Placement:
    """Where a link sits: `frame` 0 is the base, i + 1 moves with joint i; `pose` (4,4) is link to frame."""

    frame: int
    pose: FloatArray


@dataclass(frozen=True, eq=False)
class Chain:
    """A serial chain of n moving joints; `origins` (n,4,4) is joint frame to previous moving frame, m."""

    joints: tuple[Joint, ...]
    origins: FloatArray
    placements: dict[str, Placement]

    @property
    def axes(self) -> FloatArray:
        """Unit joint axes (n,3), each in its joint frame."""
        return np.array([joint.axis for joint in self.joints])

    @property
    def prismatic(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Which joints (n,) slide rather than turn."""
        return np.array([joint.type == "prismatic" for joint in self.joints])

    def links_in(self, frame: int) -> list[str]:
        """Names of the links that are rigid in `frame`."""
        return [link for link, placement in self.placements.items() if placement.frame == frame]


def serial_chain(urdf: Urdf) -> Chain:
    """Order the moving joints from base to tip and place the links; PlancurateError where it branches."""
    children = _children(urdf)
    joints: list[Joint] = []
    origins: list[FloatArray] = []
    placements = {_root(urdf): Placement(0, np.eye(4))}
    current = list(placements)
    while current:
        moving = _place_rigid(children, current, placements)
        if len(moving) > 1:
            names = " and ".join(f"'{joint.name}'" for joint in moving)
            raise PlancurateError(
                f"{urdf.file}: moving joints {names} branch; a serial chain is needed: fix all but one"
            )
        for joint in moving:
            joints.append(joint)
            origins.append(placements[joint.parent].pose @ joint.origin)
            placements[joint.child] = Placement(len(joints), np.eye(4))
        current = [joint.child for joint in moving]
    for link in urdf.links:
        if link not in placements:
            raise PlancurateError(f"{urdf.file}: link '{link}' is in a loop of joints apart from the base")
    if not joints:
        raise PlancurateError(
            f"{urdf.file}: no moving joint; at least one revolute, continuous or prismatic is needed"
        )
    _require_mass(urdf, placements, len(joints))
    return Chain(tuple(joints), np.array(origins), placements)


def _place_rigid(
    children: dict[str, list[Joint]], links: list[str], placements: dict[str, Placement]
) -> list[Joint]:
    """Place all that is fixed to `links`, side branches included; return the moving joints met on the way."""
    moving: list[Joint] = []
    queue = list(links)
    while queue:
        link = queue.pop(0)
        for joint in children[link]:
            if joint.type != "fixed":
                moving.append(joint)
                continue
            at = placements[link]
            placements[joint.child] = Placement(at.frame, at.pose @ joint.origin)
            queue.append(joint.child)
    return moving


def _children(urdf: Urdf) -> dict[str, list[Joint]]:
    children: dict[str, list[Joint]] = {link: [] for link in urdf.links}
    parent_of: dict[str, str] = {}
    for joint in urdf.joints:
        if joint.child in parent_of:
            raise PlancurateError(
                f"{urdf.file}: link '{joint.child}' is the child of '{parent_of[joint.child]}'"
                f" and '{joint.name}';"
                " closed loops are not supported"
            )
        parent_of[joint.child] = joint.name
        children[joint.parent].append(joint)
    return children


def _root(urdf: Urdf) -> str:
    children = {joint.child for joint in urdf.joints}
    roots = [link for link in urdf.links if link not in children]
    if len(roots) != 1:
        found = ", ".join(roots) or "none"
        raise PlancurateError(f"{urdf.file}: exactly one link must have no parent (the base); found {found}")
    return roots[0]


def _require_mass(urdf: Urdf, placements: dict[str, Placement], dof: int) -> None:
    """Physics needs a mass in every moving frame; a frame-only link may do without."""
    for frame in range(1, dof + 1):
        links = [link for link, placement in placements.items() if placement.frame == frame]
        if not sum(urdf.links[link].mass or 0.0 for link in links) > 0.0:
            raise PlancurateError(
                f"{urdf.file}: link '{links[0]}': <inertial> with a mass above zero is missing"
            )
