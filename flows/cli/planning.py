"""The command that lists planners."""

from __future__ import annotations

from plancurate import native
from plancurate.flows.cli.console import output, table


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
