"""Commands that list what planning is made of: robots, scenes and planners."""

from __future__ import annotations

from pathlib import Path

from plancurate import native
from plancurate.flows.cli.console import output, table
from plancurate.robots import load_robot, load_world, robot_names, scene_names


def show_robots() -> None:
    """Print the robots that come with the package and those in this folder, and the scenes."""
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


def planners() -> None:
    """List planners with their parameters, and say which are not deterministic and why."""
    shown = table("planner", "optimising", "deterministic", "parameters (OMPL's names = defaults here)")
    for planner in native.planners():
        repeatable = "yes" if planner.deterministic else f"no: {planner.note}"
        params = ", ".join(f"{name}={value}" for name, value in planner.params.items())
        shown.add_row(planner.name, "yes" if planner.optimizing else "", repeatable, params)
    output.print(shown)
    others = [planner.name for planner in native.planners() if not planner.deterministic]
    output.print(f"OMPL {native.ompl_version()}; not deterministic: {', '.join(others) or 'none'}")
