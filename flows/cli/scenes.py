"""Commands about scenes."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Literal

from pydantic import ValidationError

from plancurate.errors import PlancurateError, field_of, first_problem
from plancurate.flows.cli.console import console, output, table, write
from plancurate.robots import DEFAULT_ROBOT, load_world
from plancurate.tasks.candidates.settings import (
    GenerateSettings,
    Goals,
    Orientation,
    PlanSettings,
    TargetSettings,
)
from plancurate.tasks.candidates.sources import find_source
from plancurate.tasks.learning.settings import TESTS_BY_DISTANCE

if TYPE_CHECKING:
    from plancurate.tasks.learning.scene_check import SceneCheck

TARGETS, PLAN = TargetSettings(), PlanSettings()
MOST_TARGETS = 10_000
TESTS = sum(TESTS_BY_DISTANCE.values())


def check(
    scene: str,
    /,
    *,
    robot: str = DEFAULT_ROBOT,
    targets: int = 20,
    planner: str = "RRTConnect",
    runs: int = PLAN.runs,
    orientation: Orientation = TARGETS.orientation,
    cone_deg: float = TARGETS.cone_deg,
    clearance_m: float = PLAN.clearance_m,
    goals: Goals = PLAN.goals,
    format: Literal["table", "json"] = "table",
) -> None:
    """Say what a planner, and a straight line, reach in a scene: whether a study in it would say anything.

    Args:
        scene: Name of a scene, or a YAML file.
        robot: Name of a robot, or a folder.
        targets: How many targets to draw; each has test positions up to 5 cm from it, as in a study.
        planner: Planner of the runs to targets.
        runs: Runs to each target.
        orientation: How the tool may be turned at a target, as in candidates.targets.orientation.
        cone_deg: Greatest tilt of a cone, degrees.
        clearance_m: Distance that paths keep to obstacles beyond the scene's margin, m.
        goals: A run's goal configurations, as in candidates.plan.goals.
        format: How to print the answer; json names every target.
    """
    if not 1 <= targets <= MOST_TARGETS:
        raise PlancurateError(f"--targets = {targets}: a number from 1 to {MOST_TARGETS} would be right")
    values = {
        "targets": {"orientation": orientation, "cone_deg": cone_deg},
        "plan": {"runs": runs, "clearance_m": clearance_m, "goals": goals},
    }
    settings = checked(values)
    find_source(planner)
    from plancurate.tasks.learning.scene_check import check_scene  # SciPy: no --help needs it

    world = load_world(robot, scene)
    with console.status(f"planning to {targets} targets and {TESTS * targets} tests"):
        found = check_scene(*world, settings, targets, planner)
    if format == "json":
        write(json.dumps(as_record(found), indent=1))
    else:
        show(found)


def checked(values: dict[str, Any]) -> GenerateSettings:
    """Return the settings; PlancurateError that names the option that is wrong."""
    try:
        return GenerateSettings.model_validate(values)
    except ValidationError as error:
        option = "--" + field_of(error).rpartition(".")[2].replace("_", "-")
        raise PlancurateError(first_problem(option, error, GenerateSettings)) from None


def show(found: SceneCheck) -> None:
    """Print the verdict and what it stands on."""
    planned = found.planned
    output.print(found.verdict, style="bold", markup=False, highlight=False)
    shown = table("", "targets", "tests")
    shown.add_row("number", str(planned.targets), str(found.tests))
    shown.add_row(
        "reached by a planner",
        f"{planned.planner} {planned.reached:.0%}",
        f"{found.tests_planner} {found.tests_reached:.0%}",
    )
    shown.add_row(
        "free straight line", f"{1 - planned.hard:.0%}", f"{1 - found.tests_hard:.0%} of those reached"
    )
    shown.add_row("runs that reach", f"{planned.solved:.0%}", "")
    shown.add_row("goal configurations", f"{planned.goal_classes:.1f} a target", "")
    shown.add_row("ways", f"{planned.ways:.1f} a target", "")
    shown.add_row("clearance", clearance(planned.least_clearance, planned.median_clearance), "")
    output.print(shown)


def clearance(least: float | None, median: float | None) -> str:
    """Least and median clearance for a person."""
    if least is None or median is None:
        return "nothing near"
    return f"least {100 * least:.1f} cm, median {100 * median:.1f} cm"


def as_record(found: SceneCheck) -> dict[str, Any]:
    """Return everything as plain data; shares of 1, lengths in m."""
    planned = found.planned
    return {
        "verdict": found.verdict,
        "planner": planned.planner,
        "runs": planned.runs,
        "targets": planned.targets,
        "reached": planned.reached,
        "straight_line": 1 - planned.hard,
        "solved": planned.solved,
        "goal_configurations": planned.goal_classes,
        "ways": planned.ways,
        "least_clearance_m": planned.least_clearance,
        "median_clearance_m": planned.median_clearance,
        "tests": found.tests,
        "tests_reached": found.tests_reached,
        "tests_straight_line": 1 - found.tests_hard,
        "each": [asdict(target) for target in planned.each],
    }
