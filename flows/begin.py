"""How every stage begins."""

from __future__ import annotations

from collections.abc import Iterable

from plancurate.flows.run_page import tell
from plancurate.tasks.lake.home import Home
from plancurate.tasks.lake.mend import mend
from plancurate.tasks.lake.parts import sweep
from plancurate.tasks.study.config import StudyConfig
from plancurate.tasks.study.context import StudyContext, open_study


def begin(config: StudyConfig, home: str, *tables: str) -> StudyContext:
    """Open a study for a stage that writes these tables, and say which damaged parts of them it makes again.

    Of other tables nothing is moved aside: a stage that only reads them must refuse what is damaged there.
    """
    study = open_study(config, Home.resolve(home))
    for folder in (study.home.lake, study.home.models):
        sweep(folder)
    for name in tables:
        for pool in study.pools:
            say_made_again(damage.line for damage in mend(study.lake, name, study.study_partition(pool)))
    return study


def say_made_again(damage: Iterable[str]) -> None:
    """Print what was damaged and is made again."""
    for line in damage:
        tell(f"  [yellow]made again:[/] {line}")
