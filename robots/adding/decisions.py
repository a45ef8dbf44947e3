"""What robot.yaml says that no vendor's file does: which contacts are allowed, and where home is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from plancurate.robots.adding.findings import Findings
from plancurate.robots.adding.folding import Folded
from plancurate.robots.adding.homes import choose_home
from plancurate.robots.adding.planning_limits import MovingJoint
from plancurate.robots.adding.sampled_contacts import PairContact, never_meets
from plancurate.robots.adding.solids import Solid
from plancurate.robots.adding.source import Source
from plancurate.robots.adding.srdf import Srdf
from plancurate.robots.chain import serial_chain
from plancurate.robots.loading import DEFAULT_SCENE, build_robot
from plancurate.robots.robot import Robot
from plancurate.robots.robot_file import JointEntry, RobotFile
from plancurate.robots.scene_loading import load_scene, scenes_from_home
from plancurate.robots.urdf import read_urdf


@dataclass(frozen=True)
class Read:
    """All that the vendor's files say, without a problem."""

    source: Source
    folded: Folded
    limits: list[MovingJoint]
    solids: dict[str, Solid]
    srdf: Srdf


def decided(
    tool: str,
    home: Sequence[float],
    read: Read,
    folder: Path,
    contacts: Sequence[PairContact],
    findings: Findings,
) -> RobotFile:
    """Decide allowed contacts and home for the URDF in a folder; `home` is empty where one is to be found."""
    middles = [min(max(0.0, joint.position[0]), joint.position[1]) for joint in read.limits]
    content = RobotFile(
        urdf="robot.urdf",
        tool_link=tool,
        joints={
            joint.source.name: _entry(joint, home) for joint, home in zip(read.limits, middles, strict=True)
        },
    )
    file = folder / "robot.yaml"
    reach = build_robot(file, content, b"").reach
    allowed = _allowed(read.srdf, contacts, reach, findings)
    standing = _standing(folder)
    content = content.model_copy(update={"allowed_contacts": allowed, "scene_unchecked_links": standing})
    robot = build_robot(file, content, b"")
    chosen = home or _home(read, robot, findings)
    entries = {
        joint.source.name: _entry(joint, value) for joint, value in zip(read.limits, chosen, strict=True)
    }
    return content.model_copy(update={"joints": entries})


def _entry(joint: MovingJoint, home: float) -> JointEntry:
    return JointEntry(
        position=joint.position, velocity=joint.plan_velocity, acceleration=joint.acceleration, home=home
    )


def _allowed(
    srdf: Srdf, contacts: Sequence[PairContact], length: float, findings: Findings
) -> tuple[tuple[str, str], ...]:
    """Pairs that are not checked: disabled by the SRDF, never near each other, or touching whatever the joints do."""
    allowed = [contact.links for contact in contacts if contact.always or never_meets(contact, length)]
    for contact in contacts:
        first, second = contact.links
        if contact.always:
            findings.notes.append(f"'{first}' and '{second}' touch in every state; they are not checked")
        elif contact.often:
            findings.notes.append(contact.sentence)
    known = {frozenset(pair) for pair in allowed}
    looked_at = {frozenset(contact.links) for contact in contacts}
    allowed += [pair for pair in srdf.disabled if frozenset(pair) in looked_at - known]
    return tuple(allowed)


def _standing(folder: Path) -> tuple[str, ...]:
    """Links with shapes that are rigid to the base."""
    urdf = read_urdf(folder / "robot.urdf")
    return tuple(link for link in serial_chain(urdf).links_in(0) if urdf.links[link].shapes)


def _home(read: Read, robot: Robot, findings: Findings) -> Sequence[float]:
    """The SRDF's home, or one that is found."""
    stated = read.srdf.home(robot.joint_names)
    if stated is not None and ((stated >= robot.lower) & (stated <= robot.upper)).all():
        return stated
    found = choose_home(robot, load_scene(DEFAULT_SCENE), scenes_from_home(robot))
    if found is None:
        findings.problems.append(
            "no state without contacts was found; name one with --home, or shapes are too coarse: --shapes"
        )
        return list(robot.home)
    return [float(value) for value in found]
