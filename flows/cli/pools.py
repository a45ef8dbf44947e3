"""What a person must know of pools and selections beside results from them."""

from __future__ import annotations

from plancurate.flows.cli.console import console
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study import text
from plancurate.tasks.study.pools import study_pools
from plancurate.tasks.study.selection_results import ranking_rows


def say_degenerate(lake: Lake, study: str) -> None:
    """Name the degenerate pools of a study, if any, where no program reads."""
    for pool in study_pools(lake, study):
        if pool.degenerate:
            _say(f"{study}: {text.degenerate(pool)}")


def say_unsteady(lake: Lake, study: str) -> None:
    """Name the selections of a study, if any, whose order is mostly chance, where no program reads."""
    for row in ranking_rows(lake, study):
        if row.unsteady:
            _say(f"{study}: {text.unsteady(row)}")


def _say(sentence: str) -> None:
    console.print(sentence, style="yellow", markup=False, highlight=False, soft_wrap=True)
