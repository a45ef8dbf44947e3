"""What a person must know of the pools beside results from them."""

from __future__ import annotations

from plancurate.flows.cli.console import console
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study import text
from plancurate.tasks.study.pools import study_pools


def say_degenerate(lake: Lake, study: str) -> None:
    """Name the degenerate pools of a study, if any, where no program reads."""
    for pool in study_pools(lake, study):
        if pool.degenerate:
            said = f"{study}: {text.degenerate(pool)}"
            console.print(said, style="yellow", markup=False, highlight=False, soft_wrap=True)
