"""Commands that look after the lake."""

from __future__ import annotations

import sys
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from plancurate.flows.cli.console import output, table
from plancurate.flows.cli.options import HomeOptions
from plancurate.tasks.lake.checkup import checkup, looked_at
from plancurate.tasks.lake.retention import drop, unreferred
from plancurate.tasks.lake.status import Size, lake_status
from plancurate.tasks.lake.store import Lake


def status(options: HomeOptions = HomeOptions()) -> None:
    """Say what the lake holds: tables, parts, rows, bytes, pools, studies."""
    found = lake_status(Lake(options.folder().lake))
    shown = table("table", "parts", "rows", "size")
    for name, size in found.tables.items():
        shown.add_row(name, *cells(size))
    output.print(shown)
    pools = table("pool", "robot", "scene", "targets", "runs", "parts", "rows", "size", "studies")
    for pool in found.pools:
        studies = ", ".join(pool.studies) or "none"
        counts = (str(pool.targets), str(pool.runs))
        pools.add_row(pool.pool, pool.robot, pool.scene, *counts, *cells(pool.size), studies)
    output.print(pools)
    output.print(f"studies, the last run first: {', '.join(found.studies) or 'none'}", highlight=False)


def check(options: HomeOptions = HomeOptions()) -> None:
    """Check every stored file against its checksum and run every audit; exit with 1 where anything is wrong."""
    home = options.folder()
    lines = checkup(home)
    for line in lines or [f"{home.lake}: {looked_at(home)}, nothing wrong"]:
        say(line)
    if lines:
        sys.exit(1)


def gc(
    *names: str,
    keep_days: Annotated[float, Parameter(validator=Number(gte=0))] = 7.0,
    dry_run: bool = True,
    options: HomeOptions = HomeOptions(),
) -> None:
    """Show, and with --no-dry-run drop, what no study refers to: pools, selections, evaluations, networks, leftovers.

    Args:
        names: Only these: studies (name-key) with all that nobody else needs, pools, networks. What another study
            refers to is refused.
        keep_days: Without names, what changed in so many days stays.
        dry_run: Only show it.
    """
    home = options.folder()
    found = unreferred(home, names, keep_days)
    for item in found:
        say(f"{item.kind} {item.name}  {megabytes(item.bytes)}  {item.path.relative_to(home.root)}")
    total = megabytes(sum(item.bytes for item in found))
    if not found:
        say(f"{home.root}: nothing to drop")
    elif dry_run:
        say(f"{len(found)} to drop, {total}; --no-dry-run drops them")
    else:
        drop(home, found)
        say(f"{len(found)} dropped, {total}")


def cells(size: Size) -> tuple[str, str, str]:
    """Show how much there is."""
    return str(size.parts), str(size.rows), megabytes(size.bytes)


def megabytes(size: int) -> str:
    """Show bytes for a person."""
    return f"{size / 1e6:.2f} MB"


def say(line: str) -> None:
    """Print one line as it is, whatever its width."""
    output.print(line, highlight=False, markup=False, soft_wrap=True)
