"""Commands that list what is registered: robots, planners, selectors, policies."""

from __future__ import annotations

import inspect

from plancurate import native
from plancurate.flows.cli.console import output, table
from plancurate.robots import load_robot, load_world, robot_names, scene_names
from plancurate.tasks.curation.selectors.base import find_selector, selector_names


def robots() -> None:
    """List robots and scenes."""
    shown = table("robot", "joints", "tool", "home", "limits (rad)")
    for name in robot_names():
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


def selectors() -> None:
    """List selectors."""
    shown = table("selector", "keeps")
    for name in selector_names():
        shown.add_row(name, find_selector(name).description)
    output.print(shown)


def policies() -> None:
    """List policies with their settings."""
    from plancurate.tasks.learning.policies import kind_of, policy_names  # torch: no --help needs it

    shown = table("policy", "is", "settings")
    for name in policy_names():
        kind = kind_of(name)
        shown.add_row(
            name,
            summary(kind),
            ", ".join(f"{key}={field.default}" for key, field in kind.model_fields.items()),
        )
    output.print(shown)


def summary(thing: object) -> str:
    """First line of a docstring."""
    return (inspect.getdoc(thing) or "").partition("\n")[0]
