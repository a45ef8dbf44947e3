"""Check a robot's folder: that it loads, what touches what, and how its shapes hold a vendor's meshes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from plancurate.errors import PlancurateError
from plancurate.robots.adding.findings import Findings
from plancurate.robots.adding.model import Model
from plancurate.robots.adding.quality import FitQuality, fit_quality
from plancurate.robots.adding.sampled_contacts import sample_contacts
from plancurate.robots.adding.solids import read_solids
from plancurate.robots.adding.source import read_source
from plancurate.robots.loading import load_robot
from plancurate.robots.robot import Robot
from plancurate.robots.urdf import read_urdf


@dataclass(frozen=True)
class Checked:
    """A robot that loads, notes on it, and how its shapes fit where there is something to compare with."""

    robot: Robot
    notes: tuple[str, ...]
    quality: tuple[FitQuality, ...]


def check_robot(name_or_folder: str | Path, urdf: Path | None, packages: Sequence[Path]) -> Checked:
    """Load the robot, draw states for its contacts, compare it with the meshes of `urdf`.

    Raises PlancurateError for a folder that can't be taken, and for a mesh that its shapes do not hold.
    """
    robot = load_robot(name_or_folder)
    return Checked(robot, tuple(_contact_notes(robot)), () if urdf is None else _fit(robot, urdf, packages))


def _contact_notes(robot: Robot) -> list[str]:
    contacts = sample_contacts(Model(robot.chain, robot.shapes, robot.lower, robot.upper))
    notes = []
    for contact in contacts:
        first, second = contact.links
        unchecked = frozenset(contact.links) in robot.allowed_contacts
        if unchecked and 0.0 < contact.touching < 1.0:
            notes.append(
                f"'{first}' and '{second}' are not checked, though they touch in {contact.touching:.1%} of states"
            )
        elif not unchecked and contact.often:
            notes.append(contact.sentence)
    return notes


def _fit(robot: Robot, urdf: Path, packages: Sequence[Path]) -> tuple[FitQuality, ...]:
    findings = Findings()
    solids = read_solids(read_source(urdf, findings), packages, findings)
    own = read_urdf(robot.urdf).links
    for link, solid in solids.items():
        if len(solid.triangles) and (link not in own or not own[link].shapes):
            findings.problems.append(
                f"link '{link}' has a mesh in {urdf.name} and no shape in the robot; add it again"
            )
    findings.stop_at_problems(robot.urdf)
    quality = tuple(
        fit_quality(link, solid.triangles, own[link].shapes)
        for link, solid in solids.items()
        if len(solid.triangles)
    )
    for fit in quality:
        if fit.coverage < 1.0:
            raise PlancurateError(
                f"{robot.urdf}: link '{fit.link}': its shapes hold {fit.coverage:.2%} of the mesh; add the robot again"
            )
    return quality
