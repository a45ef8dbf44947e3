"""Commands about robots."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.flows.cli.console import console, output, table
from plancurate.robots import load_robot, load_world, robot_names, scene_names

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.table import Table

    from plancurate.robots import Robot
    from plancurate.robots.adding.quality import FitQuality


def list() -> None:
    """List robots, those in this folder among them, and scenes."""
    shown = table("robot", "joints", "tool", "home", "limits (rad, m)")
    here = sorted(file.parent.name for file in Path().glob("*/robot.yaml"))
    for name in dict.fromkeys([*robot_names(), *here]):
        robot = load_robot(name)
        home = native.fk(robot.native, robot.home[None])[0, :3, 3]
        limits = ", ".join(
            f"{lower:.2f}..{upper:.2f}" for lower, upper in zip(robot.lower, robot.upper, strict=True)
        )
        where = "tool at " + ", ".join(f"{x:.3f}" for x in home) + " m"
        shown.add_row(name, str(robot.dof), robot.tool_link, where, limits)
    output.print(shown)
    scenes = table("scene", "floor", "obstacles")
    for name in scene_names():
        scene = load_world(robot_names()[0], name)[1]
        floor = "none" if scene.ground is None else f"z = {scene.ground:g} m"
        scenes.add_row(name, floor, str(len(scene.shapes)))
    output.print(scenes)


def add(
    urdf: Path,
    /,
    *,
    tool: str,
    name: str,
    joint: tuple[str, ...] = (),
    package_path: tuple[Path, ...] = (),
    srdf: Path | None = None,
    home: tuple[float, ...] = (),
    velocity: float | None = None,
    effort: float | None = None,
    shapes: int = 5,
    into: Path = Path(),
) -> None:
    """Make a robot's folder from a vendor's URDF: meshes become primitive shapes that hold them.

    Args:
        urdf: The vendor's URDF.
        tool: Link that targets are for, such as a flange or a grasp point.
        name: Name of the robot and of the folder.
        joint: NAME=VALUE holds a joint there, rad or m, such as a gripper's opening; may be given several times.
        package_path: Folder of a ROS package, or one that holds packages; may be given several times.
        srdf: MoveIt's SRDF: pairs of links that need no check, and a home.
        home: Joint positions, rad or m, in the order of the chain; left out, one is found.
        velocity: Greatest speed of joints whose limit the URDF leaves out, rad/s or m/s.
        effort: Greatest torque or force of joints whose limit the URDF leaves out, N m or N.
        shapes: Most primitive shapes of a link.
        into: Folder that the robot's folder is made in.
    """
    if shapes < 1:
        raise PlancurateError(f"--shapes {shapes}: at least 1 would be right")
    from plancurate.robots.adding.add import Request, add_robot  # SciPy and trimesh: no --help needs them

    request = Request(
        urdf=urdf, tool=tool, name=name, into=into, packages=package_path, srdf=srdf,
        joints=dict(_held(word) for word in joint), home=home, velocity=velocity, effort=effort, shapes_a_link=shapes,
    )  # fmt: skip
    with console.status("enclosing meshes in primitive shapes"):
        made = add_robot(request)
    say(made.notes, made.quality, f"{made.folder}: {size(made.robot)}; fit.png shows the fit")


def check(name: str, /, *, urdf: Path | None = None, package_path: tuple[Path, ...] = ()) -> None:
    """Check a robot's folder again: limits, home, contacts; with the vendor's URDF, how its shapes fit the meshes.

    Args:
        name: Name of a robot, or a folder.
        urdf: The vendor's URDF, whose meshes the shapes must hold.
        package_path: Folder of a ROS package, or one that holds packages; may be given several times.
    """
    from plancurate.robots.adding.check import check_robot

    found = check_robot(name, urdf, package_path)
    say(found.notes, found.quality, f"{found.robot.name}: {size(found.robot)}: nothing is wrong")


def _held(word: str) -> tuple[str, float]:
    name, _, value = word.partition("=")
    try:
        return name, float(value)
    except ValueError:
        raise PlancurateError(
            f"--joint {word}: NAME=VALUE would be right, such as finger_joint=0.04"
        ) from None


def size(robot: Robot) -> str:
    """How large a robot is, in words."""
    return f"{robot.dof} joints, {robot.reach:g} m of reach"


def say(notes: Sequence[str], quality: Sequence[FitQuality], verdict: str) -> None:
    """Print what was noticed, how well shapes fit, and what came of it."""
    for note in notes:
        output.print(f"- {note}", markup=False, highlight=False, soft_wrap=True)
    if quality:
        output.print(quality_table(quality))
    output.print(verdict, markup=False, soft_wrap=True)


def quality_table(quality: Sequence[FitQuality]) -> Table:
    """How well shapes fit, a link a row."""
    from plancurate.robots.adding.readme import shapes_of

    shown = table("link", "shapes", "of the mesh inside", "sticks out in the mean", "at most")
    for fit in quality:
        shown.add_row(
            fit.link, shapes_of(fit), f"{fit.coverage:.2%}", f"{1000 * fit.mean_protrusion:.1f} mm",
            f"{1000 * fit.most_protrusion:.1f} mm",
        )  # fmt: skip
    return shown
