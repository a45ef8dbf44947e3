"""What a robot is: a folder with `robot.yaml` and a URDF, loaded into arrays and the native model."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from plancurate import native
from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.robots.chain import Chain, serial_chain
from plancurate.robots.contacts import LinkShape, allowed_pairs, checked_pairs, link_shapes
from plancurate.robots.files import read_yaml
from plancurate.robots.limits import Limits, joint_limits
from plancurate.robots.robot_file import RobotFile
from plancurate.robots.shapes import FloatArray, shape_arrays
from plancurate.robots.urdf import Urdf, read_urdf

ROBOTS_FOLDER = Path(__file__).parent
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")  # a robot's name becomes a folder of the lake


@dataclass(frozen=True, eq=False)
class Robot:
    """A serial arm of n joints; limits, `effort` and `home` are (n,) in rad (m), s and N m (N)."""

    name: str
    urdf: Path
    joint_names: tuple[str, ...]
    lower: FloatArray
    upper: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    effort: FloatArray
    home: FloatArray
    tool_link: str
    native: native.Robot
    digest: str  # of the contents of robot.yaml and the URDF
    allowed_contacts: frozenset[frozenset[str]]  # pairs of links never checked, adjacent ones included
    scene_unchecked_links: frozenset[str]
    chain: Chain
    shapes: tuple[LinkShape, ...]

    @property
    def dof(self) -> int:
        """Number of moving joints."""
        return len(self.joint_names)


def robot_names() -> list[str]:
    """Names of the robots that come with the package."""
    return sorted(file.parent.name for file in ROBOTS_FOLDER.glob("*/robot.yaml"))


def load_robot(name_or_folder: str | Path) -> Robot:
    """Load a robot by name, or from a folder with `robot.yaml`; PlancurateError says what cannot be taken."""
    folder = _robot_folder(name_or_folder)
    file = folder / "robot.yaml"
    content = read_yaml(file, RobotFile)
    urdf = read_urdf(folder / content.urdf)
    chain = serial_chain(urdf)
    limits = joint_limits(file, content, chain)
    shapes = link_shapes(urdf, chain)
    allowed = allowed_pairs(file, content, chain)
    unchecked = _known_links(file, content.scene_unchecked_links, urdf)
    return Robot(
        name=folder.resolve().name,
        urdf=urdf.file,
        joint_names=tuple(joint.name for joint in chain.joints),
        lower=limits.lower,
        upper=limits.upper,
        velocity=limits.velocity,
        acceleration=limits.acceleration,
        effort=np.array([joint.effort for joint in chain.joints]),
        home=limits.home,
        tool_link=content.tool_link,
        native=_native_robot(chain, _tool(file, content, chain), limits, shapes, allowed, unchecked),
        digest=hashlib.sha256(file.read_bytes() + urdf.file.read_bytes()).hexdigest()[:12],
        allowed_contacts=allowed,
        scene_unchecked_links=unchecked,
        chain=chain,
        shapes=shapes,
    )


def _robot_folder(name_or_folder: str | Path) -> Path:
    if str(name_or_folder) in robot_names():
        return ROBOTS_FOLDER / name_or_folder
    folder = Path(name_or_folder)
    if not folder.is_dir():
        if isinstance(name_or_folder, Path) or len(folder.parts) > 1:
            raise PlancurateError(
                f"{folder}: no such folder; a robot is a folder with a robot.yaml and a URDF"
            )
        raise UnknownNameError("robot", name_or_folder, robot_names())
    if not NAME.fullmatch(folder.resolve().name):
        raise PlancurateError(
            f"{folder}: a robot folder's name may hold letters, digits, '_', '.' and '-' only"
        )
    return folder


def _known_links(file: Path, names: tuple[str, ...], urdf: Urdf) -> frozenset[str]:
    for name in names:
        if name not in urdf.links:
            raise PlancurateError(
                f"{file}: scene_unchecked_links: {UnknownNameError('link', name, urdf.links)}"
            )
    return frozenset(names)


def _tool(file: Path, content: RobotFile, chain: Chain) -> FloatArray:
    """Pose (4,4) of the tool link in the last moving frame."""
    placement = chain.placements.get(content.tool_link)
    if placement is None:
        raise PlancurateError(
            f"{file}: tool_link: {UnknownNameError('link', content.tool_link, chain.placements)}"
        )
    if placement.frame != len(chain.joints):
        valid = ", ".join(chain.links_in(len(chain.joints)))
        raise PlancurateError(
            f"{file}: tool_link: '{content.tool_link}' must move with the last joint; valid are {valid}"
        )
    return placement.pose


def _native_robot(
    chain: Chain,
    tool: FloatArray,
    limits: Limits,
    shapes: tuple[LinkShape, ...],
    allowed: frozenset[frozenset[str]],
    unchecked: frozenset[str],
) -> native.Robot:
    scene_shapes = [index for index, shape in enumerate(shapes) if shape.link not in unchecked]
    return native.Robot(
        origins=chain.origins,
        axes=chain.axes,
        prismatic=chain.prismatic,
        tool=tool,
        lower=limits.lower,
        upper=limits.upper,
        shape_frames=np.array([shape.frame for shape in shapes], dtype=np.int32),
        pairs=checked_pairs(shapes, allowed),
        scene_shapes=np.array(scene_shapes, dtype=np.int32),
        **shape_arrays([shape.shape for shape in shapes]),
    )
