"""Find a study by its name and read how it was set up."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from plancurate.errors import UnknownNameError
from plancurate.tasks.lake.store import Lake


@dataclass(frozen=True)
class StudyPool:
    """One pool of a study."""

    scene: str
    pool_label: str
    """The variant of candidates; empty where the study has one."""
    pool: str
    n_targets: int
    planners: tuple[str, ...]


@dataclass(frozen=True)
class Study:
    """How a study was set up. `study` (name and key) identifies it in every table of the lake and in MLflow."""

    study: str
    name: str
    key: str
    robot: str
    pools: tuple[StudyPool, ...]
    config: Mapping[str, Any]
    run_at: datetime
    package_version: str
    ompl_version: str


def find_study(lake: Lake, name: str, key: str | None = None) -> str:
    """Return the identifier (name and key) of the study that ran last under a name, or of the one with that key.

    An identifier is taken for a name too. UnknownNameError names what is known.
    """
    known = lake.query_sound("results/studies").to_pylist()  # the last run first
    own = [row for row in known if row["name"] == name] or [row for row in known if row["study"] == name]
    if not own:
        raise UnknownNameError("study", name, {row["name"] for row in known})
    if key is None:
        return str(own[0]["study"])
    for row in own:
        if row["study_key"] == key:
            return str(row["study"])
    raise UnknownNameError(f"key of study {name}", key, [row["study_key"] for row in own])


def recorded_study(lake: Lake, study: str) -> Study:
    """Return how a study was set up, by its identifier; UnknownNameError when there is none."""
    rows = lake.query("results/study", study=study).to_pylist()
    if not rows:
        raise UnknownNameError("study", study, lake.query_sound("results/studies")["study"].to_pylist())
    last = max(rows, key=lambda row: row["run_at"])
    pools = tuple(
        StudyPool(row["scene"], row["pool_label"], row["pool"], row["n_targets"], tuple(row["planners"]))
        for row in rows
    )
    return Study(
        study=study,
        name=last["name"],
        key=last["study_key"],
        robot=last["robot"],
        pools=pools,
        config=json.loads(last["config"]),
        run_at=last["run_at"],
        package_version=last["package_version"],
        ompl_version=last["ompl_version"],
    )
