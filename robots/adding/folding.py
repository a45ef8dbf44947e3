"""Which joints of a vendor's URDF move the tool, and where all others are held."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.spatial.transform import Rotation

from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.robots.adding.findings import Findings
from plancurate.robots.adding.source import TURNING, Source, SourceJoint
from plancurate.robots.shapes import FloatArray


@dataclass(frozen=True, eq=False)
class Folded:
    """The joints that move, base first, and the positions, rad or m, of all others that could."""

    moving: tuple[SourceJoint, ...]
    held: dict[str, float]

    def origin(self, joint: SourceJoint) -> FloatArray:
        """Transform (4,4) of child to parent frame: of a held joint with its motion, else at zero."""
        motion = np.eye(4)
        value = self.held.get(joint.name, 0.0)
        if joint.type in TURNING:
            motion[:3, :3] = Rotation.from_rotvec(joint.axis * value).as_matrix()
        elif joint.moves:
            motion[:3, 3] = joint.axis * value
        return np.asarray(joint.origin @ motion)


def fold(source: Source, tool: str, stated: Mapping[str, float], findings: Findings) -> Folded:
    """Find the chain from the base to link `tool`; the rest is held, at `stated` positions where there are any."""
    movable = [joint.name for joint in source.joints.values() if joint.moves]
    for name in stated:
        if name not in movable:
            findings.problems.append(f"--joint: {UnknownNameError('moving joint', name, movable)}")
    if tool not in source.links:
        findings.problems.append(f"--tool: {UnknownNameError('link', tool, source.links)}")
        return Folded((), {})
    path = _path(source, tool)
    moving = tuple(j for j in path if j.moves and j.name not in stated and j.mimic is None)
    if not moving:
        findings.problems.append(
            f"--tool: nothing moves between '{source.root}' and '{tool}'; name a link beyond the joints"
        )
    _note_free_bases(path, findings)
    chain = {joint.name for joint in moving}
    held: dict[str, float] = {}
    for joint in source.joints.values():
        if joint.moves and joint.name not in chain:
            read = partial(_position, source, joint, chain, stated, ())
            held[joint.name] = findings.attempt(read, 0.0)
            if joint.name not in stated:
                told = f"; --joint {joint.name}=VALUE holds it elsewhere"
                findings.notes.append(f"joint '{joint.name}' is held at {held[joint.name]:g}{told}")
    return Folded(moving, held)


def _path(source: Source, tool: str) -> list[SourceJoint]:
    """The joints from the base to link `tool`."""
    path, parents = [], source.parents
    while tool in parents:
        path.append(parents[tool])
        tool = parents[tool].parent
        if len(path) > len(parents):
            raise PlancurateError(f"{source.file}: link '{tool}' is in a loop of joints apart from the base")
    return path[::-1]


def _note_free_bases(path: list[SourceJoint], findings: Findings) -> None:
    for joint in path:
        if not joint.moves and joint.type != "fixed":
            findings.notes.append(
                f"joint '{joint.name}' is {joint.type}; it is held at zero, the base stands still"
            )


def _position(
    source: Source, joint: SourceJoint, chain: set[str], stated: Mapping[str, float], seen: tuple[str, ...]
) -> float:
    """Where `joint` is held: as stated, as it mimics, else the position of its range that is nearest to zero."""
    lower, upper = joint.limit.get("lower", -math.inf), joint.limit.get("upper", math.inf)
    if joint.type == "continuous" or lower > upper:
        lower, upper = -math.inf, math.inf
    if joint.name in stated:
        value = stated[joint.name]
        if not lower <= value <= upper:
            raise PlancurateError(f"--joint {joint.name}={value:g}: must lie within [{lower:g}, {upper:g}]")
        return value
    if joint.mimic is None:
        return min(max(0.0, lower), upper)
    followed = source.joints.get(joint.mimic.joint)
    if followed is None or joint.name in seen:
        raise PlancurateError(f"joint '{joint.name}': mimics '{joint.mimic.joint}', which is no joint to follow; "
                              f"hold it with --joint {joint.name}=0")  # fmt: skip
    if followed.name in chain:
        raise PlancurateError(
            f"joint '{joint.name}': mimics '{followed.name}', which moves the tool; a coupled motion is not "
            f"supported: hold it with --joint {joint.name}=0, or {followed.name}"
        )
    return (
        joint.mimic.multiplier * _position(source, followed, chain, stated, (*seen, joint.name))
        + joint.mimic.offset
    )
