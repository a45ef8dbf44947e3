"""Shots of what the lake holds: trajectories, selections, the ways to a target."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from plancurate.errors import PlancurateError
from plancurate.robots import Robot, Scene, load_world
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.motion.lake_motions import stored_trajectory
from plancurate.tasks.pictures.drawing import Dot, Line
from plancurate.tasks.pictures.shot import COLOURS, GOOD, TARGET, Run, Shot, motion_run
from plancurate.tasks.pictures.solids import tool_path

MOST_LINES = 400  # more hide each other
PLAYED = 6  # motions that a film of many plays


def trajectory_shot(lake: Lake, trajectory_id: str) -> Shot:
    """A trajectory of the lake in its own robot and scene; PlancurateError for an unknown or failed one."""
    stored = stored_trajectory(lake, trajectory_id)
    robot, scene = load_world(stored.robot, stored.scene)
    return Shot(robot, scene, (motion_run(robot, scene, stored.motion(robot)),), title=trajectory_id)


def selection_rows(lake: Lake, selection_id: str) -> list[dict[str, Any]]:
    """What a selection kept; PlancurateError where there is none of that id."""
    rows: list[dict[str, Any]] = lake.query("pictures/selection", selection_id=selection_id).to_pylist()
    if not rows:
        raise PlancurateError(
            f"{lake.root}: no selection '{selection_id}'; plancurate sql \"SELECT DISTINCT selector, budget, "
            'selection_id FROM selections" lists what there is'
        )
    return rows


def selection_shot(rows: Sequence[Mapping[str, Any]], robot: Robot, scene: Scene) -> Shot:
    """The tool paths of all that a selection kept, a colour for each target."""
    shown = rows[:: -(-len(rows) // MOST_LINES)]
    lines = tuple(Line(path_of(robot, row), tint(row["target_id"]), 1.2) for row in shown)
    dots = tuple({row["target_id"]: Dot(target_of(row), TARGET, 3.0) for row in rows}.values())
    budget = "" if rows[0]["budget"] is None else f" k={rows[0]['budget']}"
    title = f"{rows[0]['selector']}{budget} keeps {len(rows)} trajectories to {len(dots)} targets"
    return Shot(robot, scene, lines=lines, dots=dots, title=title)


def ways_shot(lake: Lake, study: str, scene: str, target_id: int | None, world: tuple[Robot, Scene]) -> Shot:
    """The candidates to a target, a colour for each way; the shortest of each way is played."""
    rows = lake.query("pictures/ways", study=study, scene=scene, target_id=target_id).to_pylist()
    if not rows:
        which = "" if target_id is None else f" to target {target_id}"
        raise PlancurateError(f"study {study}: no verified candidate{which} in scene {scene}")
    robot, loaded = world
    names = list(dict.fromkeys(row["way"] for row in rows))
    colours = {name: tint(number) for number, name in enumerate(names)}
    lines = tuple(Line(path_of(robot, row), colours[row["way"]], 1.2) for row in rows)
    shortest = {row["way"]: row for row in reversed(rows)}
    runs = tuple(
        run_of(shortest[name], colours[name], f"way {name}, {shortest[name]['path_length']:.2f} m")
        for name in names[:PLAYED]
    )
    title = f"target {rows[0]['target_id']}: {len(rows)} candidates, {len(names)} ways"
    return Shot(robot, loaded, runs, lines, (Dot(target_of(rows[0]), TARGET, 6.0, ring=True),), title)


def run_of(row: Mapping[str, Any], colour: str = GOOD, said: str = "") -> Run:
    """A planned trajectory as a motion."""
    q = np.array(row["q"], dtype=np.float64)
    return Run(np.arange(len(q), dtype=np.float64) * float(row["dt"]), q, colour, said)


def path_of(robot: Robot, row: Mapping[str, Any]) -> FloatArray:
    """The tool's path (k, 3), m."""
    return tool_path(robot, np.array(row["q"], dtype=np.float64))


def target_of(row: Mapping[str, Any]) -> FloatArray:
    """The position aimed at (3,), m."""
    return np.array([row["target_x"], row["target_y"], row["target_z"]])


def tint(number: int) -> str:
    """One of few colours."""
    return COLOURS[number % len(COLOURS)]
