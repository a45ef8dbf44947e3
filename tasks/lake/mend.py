"""Clear a partition of what is damaged, so that whoever makes its parts makes them again."""

from __future__ import annotations

import uuid
from collections.abc import Mapping
from pathlib import Path

from plancurate.tasks.lake.inspection import Damage, refuse
from plancurate.tasks.lake.manifest import MANIFEST, forget, locked
from plancurate.tasks.lake.schema import Table, table
from plancurate.tasks.lake.store import Lake


def mend(lake: Lake, name: str, levels: Mapping[str, str]) -> list[Damage]:
    """Move damaged parts of the partitions that match aside and forget missing ones; returns what was wrong.

    A part is kept beside its old path as `.<name>.<random>.damaged`, which no reader looks at. PlancurateError for
    a part of another release: that one is sound, and only its release can read it.
    """
    kind = table(name)
    return [
        damage
        for folder in lake.partitions(name, levels)
        if lake.inspection.settled(folder, kind).damage
        for damage in _mend_partition(lake, kind, folder)
    ]


def _mend_partition(lake: Lake, kind: Table, folder: Path) -> tuple[Damage, ...]:
    with locked(folder):
        damage = lake.inspection.look(folder, kind).damage
        refuse(problem for problem in damage if problem.kind == "other version")
        for path in {problem.path for problem in damage}:
            if path.exists() and path.name != MANIFEST:
                path.rename(path.with_name(f".{path.name}.{uuid.uuid4().hex[:8]}.damaged"))
        forget(folder, (problem.path.name for problem in damage))
    return damage
