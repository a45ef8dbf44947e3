"""Make a robot's folder from a vendor's URDF."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from plancurate.robots.adding.decisions import Read, decided
from plancurate.robots.adding.findings import Findings
from plancurate.robots.adding.folding import fold
from plancurate.robots.adding.inertias import Inertial, guessed_inertial, read_inertial
from plancurate.robots.adding.model import Model
from plancurate.robots.adding.picture import draw_fit
from plancurate.robots.adding.planning_limits import MovingJoint, planning_limits
from plancurate.robots.adding.quality import FitQuality, fit_quality
from plancurate.robots.adding.readme import readme_text
from plancurate.robots.adding.refining import refined
from plancurate.robots.adding.sampled_contacts import PairContact, sample_contacts
from plancurate.robots.adding.solids import read_solids
from plancurate.robots.adding.source import read_source
from plancurate.robots.adding.srdf import read_srdf
from plancurate.robots.adding.writing import urdf_text, yaml_text
from plancurate.robots.chain import serial_chain
from plancurate.robots.files import NAME
from plancurate.robots.loading import load_robot, robot_names
from plancurate.robots.robot import Robot
from plancurate.robots.shapes import Shape
from plancurate.robots.urdf import read_urdf

SHAPES_A_LINK = 5


@dataclass(frozen=True)
class Request:
    """What a robot is made of: its URDF, the tool's link, and what the URDF leaves open."""

    urdf: Path
    tool: str
    name: str
    into: Path = Path()
    packages: tuple[Path, ...] = ()
    srdf: Path | None = None
    joints: Mapping[str, float] = field(default_factory=dict)  # positions of joints that are held, rad or m
    home: tuple[float, ...] = ()
    velocity: float | None = None
    effort: float | None = None
    shapes_a_link: int = SHAPES_A_LINK


@dataclass(frozen=True)
class Added:
    """The folder made, what was decided on the way, how well the shapes fit, and what touches what."""

    folder: Path
    robot: Robot
    notes: tuple[str, ...]
    quality: tuple[FitQuality, ...]
    contacts: tuple[PairContact, ...]


def add_robot(request: Request) -> Added:
    """Make the folder `into/name`; PlancurateError lists every problem with its remedy, and nothing is written."""
    findings = Findings()
    read = read_all(request, findings)
    model = _bare_model(read)
    shapes = refined(model, read.solids, request.shapes_a_link)
    inertials = _inertials(read, shapes, findings)
    findings.stop_at_problems(request.urdf)
    quality = tuple(
        fit_quality(link, solid.triangles, shapes[link][len(solid.shapes) :])
        for link, solid in read.solids.items()
        if len(solid.triangles)
    )
    request.into.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=request.into, prefix=".adding-") as work:
        folder = Path(work) / request.name
        folder.mkdir()
        text = urdf_text(request.name, read.source, read.folded, read.limits, shapes, inertials)
        (folder / "robot.urdf").write_text(text, encoding="utf-8")
        contacts = tuple(sample_contacts(model.with_shapes(shapes)))
        content = decided(request.tool, request.home, read, folder, contacts, findings)
        findings.stop_at_problems(request.urdf)
        (folder / "robot.yaml").write_text(yaml_text(content, request.name), encoding="utf-8")
        robot = load_robot(folder)
        draw_fit(folder / "fit.png", robot, {link: solid.triangles for link, solid in read.solids.items()})
        (folder / "README.md").write_text(
            readme_text(request.name, request.urdf, read.folded, quality, findings.notes), encoding="utf-8"
        )
        made = folder.rename(request.into / request.name)
    return Added(made, load_robot(made), tuple(findings.notes), quality, contacts)


def read_all(request: Request, findings: Findings) -> Read:
    """Read the vendor's files; raise PlancurateError with all that is wrong in them and in the request."""
    _require_name(request, findings)
    source = read_source(request.urdf, findings)
    folded = fold(source, request.tool, request.joints, findings)
    limits = planning_limits(folded.moving, request.velocity, request.effort, findings)
    _require_home(request.home, limits, findings)
    solids = read_solids(source, request.packages, findings)
    srdf = read_srdf(request.srdf, source.links, findings)
    findings.stop_at_problems(request.urdf)
    return Read(source, folded, limits, solids, srdf)


def _require_name(request: Request, findings: Findings) -> None:
    folder = request.into / request.name
    if not NAME.fullmatch(request.name):
        findings.problems.append(f"--name {request.name}: may hold letters, digits, '_', '.' and '-' only")
    elif request.name in robot_names():
        findings.problems.append(
            f"--name {request.name}: a robot of that name comes with plancurate; choose another"
        )
    elif folder.exists():
        findings.problems.append(f"--name {request.name}: {folder} exists; choose another name, or remove it")


def _require_home(home: Sequence[float], limits: Sequence[MovingJoint], findings: Findings) -> None:
    if home and len(home) != len(limits):
        names = ", ".join(joint.source.name for joint in limits)
        findings.problems.append(f"--home: {len(home)} positions; {len(limits)} joints move: {names}")
        return
    for value, joint in zip(home, limits, strict=False):
        low, high = joint.position
        if not low <= value <= high:
            findings.problems.append(
                f"--home: {joint.source.name}={value:g} must lie within [{low:g}, {high:g}]"
            )


def _inertials(read: Read, shapes: Mapping[str, Sequence[Shape]], findings: Findings) -> dict[str, Inertial]:
    """Inertials by link; a joint that moves nothing with a mass gets one for the link below it."""
    found = {
        link: read_inertial(link, element, shapes[link], findings)
        for link, element in read.source.links.items()
    }
    inertials = {link: inertial for link, inertial in found.items() if inertial is not None}
    for joint in read.folded.moving:
        rigid = _rigid_with(read, joint.child)
        if not any(link in inertials for link in rigid):
            link = next((link for link in rigid if shapes[link]), joint.child)
            inertials[link] = guessed_inertial(link, shapes[link], findings)
    return inertials


def _rigid_with(read: Read, link: str) -> list[str]:
    """The link and all below it that moves with it."""
    moving, links = {joint.name for joint in read.folded.moving}, [link]
    for found in links:  # grows while it is gone through
        links += [j.child for j in read.source.joints.values() if j.parent == found and j.name not in moving]
    return links


def _bare_model(read: Read) -> Model:
    """The robot without shapes."""
    none: dict[str, tuple[Shape, ...]] = dict.fromkeys(read.source.links, ())
    weights = {
        link: guessed_inertial(link, (), Findings()) for link in read.source.links
    }  # a chain needs some
    with tempfile.TemporaryDirectory() as work:
        file = Path(work) / "robot.urdf"
        file.write_text(
            urdf_text("bare", read.source, read.folded, read.limits, none, weights), encoding="utf-8"
        )
        chain = serial_chain(read_urdf(file))
    lower, upper = np.array([joint.position for joint in read.limits]).T
    return Model(chain, (), lower, upper)
