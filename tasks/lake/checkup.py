"""Everything in a home that is not as it was written or breaks what must hold, one line each."""

from __future__ import annotations

from pathlib import Path

from plancurate.sql import names
from plancurate.tasks.lake.audits import failed_audits
from plancurate.tasks.lake.home import Home
from plancurate.tasks.lake.manifest import MANIFEST, folder_damage
from plancurate.tasks.lake.store import Lake


def checkup(home: Home) -> list[str]:
    """Read every part and policy through and run every audit over the sound parts; returns what is wrong.

    PlancurateError where there is no lake.
    """
    lake = Lake(home.lake)
    failed = failed_audits(lake, sound_only=True)
    return [
        *(problem.line for problem in lake.damage()),
        *(line for folder in policies(home) for line in folder_damage(folder)),
        *(f"sql/audits/{name}.sql: {rows} rows break what must hold" for name, rows in failed.items()),
    ]


def looked_at(home: Home) -> str:
    """How much a checkup of the home looks at, in a few words."""
    parts = len(list(home.lake.rglob("part-*.parquet")))
    return f"{parts} parts, {len(policies(home))} policies, {len(names('audits'))} audits"


def policies(home: Home) -> list[Path]:
    """Folders of trained policies, those that MLflow keeps included."""
    trained = [folder for folder in home.models.glob("[!.]*") if folder.is_dir()]
    return sorted([*trained, *(path.parent for path in home.artifacts.rglob(MANIFEST))])
