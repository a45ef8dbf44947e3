"""How every stage begins."""

from __future__ import annotations

from plancurate.flows.cli.console import console
from plancurate.tasks.lake.home import Home
from plancurate.tasks.lake.mend import mend
from plancurate.tasks.study.config import StudyConfig
from plancurate.tasks.study.context import StudyContext, open_study


def begin(config: StudyConfig, home: str | None, *tables: str) -> StudyContext:
    """Open a study for a stage that writes these tables, and say which damaged parts of them it makes again.

    Of other tables nothing is moved aside: a stage that only reads them must refuse what is damaged there.
    """
    study = open_study(config, Home.resolve(home))
    study.lake.sweep()
    for name in tables:
        for pool in study.pools:
            for damage in mend(study.lake, name, study.study_partition(pool)):
                console.print(f"  [yellow]made again:[/] {damage.line}", highlight=False, soft_wrap=True)
    return study
