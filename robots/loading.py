"""Load a robot from its folder: `robot.yaml` and a URDF."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np

from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.robots.chain import Chain, serial_chain
from plancurate.robots.collisions import colliding_pairs
from plancurate.robots.contacts import allowed_pairs, checked_pairs, link_shapes, scene_shapes
from plancurate.robots.files import NAME, read_yaml
from plancurate.robots.limits import joint_limits
from plancurate.robots.robot import Robot, native_model
from plancurate.robots.robot_file import RobotFile
from plancurate.robots.scene import empty_scene
from plancurate.robots.shapes import FloatArray
from plancurate.robots.urdf import Urdf, read_urdf

ROBOTS_FOLDER = Path(__file__).parent
DEFAULT_ROBOT, DEFAULT_SCENE = "h2017", "free"  # where none is named


def robot_names() -> list[str]:
    """Names of the robots that come with the package."""
    return sorted(file.parent.name for file in ROBOTS_FOLDER.glob("*/robot.yaml"))


def load_robot(name_or_folder: str | Path) -> Robot:
    """Load a robot by name, or from a folder with `robot.yaml`; PlancurateError says what cannot be taken."""
    folder = _robot_folder(name_or_folder)
    file = folder / "robot.yaml"
    robot = build_robot(file, read_yaml(file, RobotFile), file.read_bytes())
    _require_free_home(file, robot)
    return robot


def build_robot(file: Path, content: RobotFile, written: bytes) -> Robot:
    """Build what `content` says, the content of `file` as `written`; whether its home is free is not looked at."""
    urdf = read_urdf(file.parent / content.urdf)
    chain = serial_chain(urdf)
    tool = _tool(file, content, chain)
    limits = joint_limits(file, content, chain)
    shapes = link_shapes(urdf, chain)
    allowed = allowed_pairs(file, content, chain)
    unchecked = _known_links(file, content.scene_unchecked_links, urdf)
    return Robot(
        name=file.parent.resolve().name,
        urdf=urdf.file,
        joint_names=tuple(joint.name for joint in chain.joints),
        lower=limits.lower,
        upper=limits.upper,
        velocity=limits.velocity,
        acceleration=limits.acceleration,
        jerk=limits.jerk,
        effort=np.array([joint.effort for joint in chain.joints]),
        home=limits.home,
        tool_link=content.tool_link,
        native=native_model(
            chain,
            shapes,
            tool=tool,
            lower=limits.lower,
            upper=limits.upper,
            pairs=checked_pairs(shapes, allowed),
            scene_shapes=scene_shapes(shapes, unchecked),
        ),
        digest=hashlib.sha256(written + urdf.file.read_bytes()).hexdigest()[:12],
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


def _require_free_home(file: Path, robot: Robot) -> None:
    contacts = colliding_pairs(robot, empty_scene(), robot.home)
    if contacts:
        raise PlancurateError(
            f"{file}: joints: at home {', '.join(contacts)} touch; change home or add to allowed_contacts"
        )
