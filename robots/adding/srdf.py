"""What MoveIt's SRDF adds to a URDF: pairs of links that need no check, and named poses."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.robots.adding.findings import Findings
from plancurate.robots.urdf_values import numbers

HOMES = ("home", "ready", "default")  # names of poses that are taken for a home, the best first


@dataclass(frozen=True)
class Srdf:
    """Pairs of links whose collisions are disabled, and joint positions of named poses."""

    disabled: tuple[tuple[str, str], ...] = ()
    poses: tuple[tuple[str, dict[str, float]], ...] = ()

    def home(self, joints: Iterable[str]) -> list[float] | None:
        """The pose that is called a home and names all the joints."""
        wanted = list(joints)
        for name in HOMES:
            for called, values in self.poses:
                if called == name and all(joint in values for joint in wanted):
                    return [values[joint] for joint in wanted]
        return None


def read_srdf(file: Path | None, links: Iterable[str], findings: Findings) -> Srdf:
    """Read `file`; nothing without one. Links that the URDF lacks are problems."""
    if file is None:
        return Srdf()
    try:
        root = ET.parse(file).getroot()
    except (OSError, ET.ParseError) as error:
        findings.problems.append(f"--srdf {file}: not a readable SRDF: {error}")
        return Srdf()
    known, pairs = set(links), []
    for element in root.findall("disable_collisions"):
        pair = (element.get("link1", ""), element.get("link2", ""))
        for link in pair:
            if link not in known:
                findings.problems.append(f"--srdf {file}: {UnknownNameError('link', link, known)}")
        pairs.append(pair)
    poses = tuple(
        (state.get("name", ""), _pose(file, state, findings)) for state in root.findall("group_state")
    )
    return Srdf(tuple(pairs), poses)


def _pose(file: Path, state: ET.Element, findings: Findings) -> dict[str, float]:
    where = f"--srdf {file}: group_state '{state.get('name')}'"
    try:
        return {j.get("name", ""): numbers(where, j, "value", 1)[0] for j in state.findall("joint")}
    except PlancurateError as error:
        findings.problems.append(str(error))
        return {}
