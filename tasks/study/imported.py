"""Recorded motions as a pool of a home's lake, and the study file that names it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import yaml

from plancurate.errors import PlancurateError
from plancurate.robots import load_robot
from plancurate.tasks.candidates.recorded import Grouped, by_target, recorded_rows, set_id
from plancurate.tasks.candidates.sources.recorded import SOURCE
from plancurate.tasks.candidates.target_table import target_rows, targets_key
from plancurate.tasks.exports.reading import read_set
from plancurate.tasks.lake.home import Home
from plancurate.tasks.study.config import StudyConfig
from plancurate.tasks.study.context import PoolContext, open_study
from plancurate.yaml_files import merged

DECIDED = {"name", "robot", "scenes", "n_targets", "planners", "candidates"}
"""The fields of a study that an import decides."""


@dataclass(frozen=True, eq=False)
class Imported:
    """What became of a set."""

    set_id: str
    study_file: Path
    """YAML for `plancurate study --config`."""
    pool: PoolContext
    n_targets: int
    rows: pa.Table
    """Of `trajectories`, one an episode."""
    elsewhere: int
    """Episodes that do not begin at the robot's home, where policies are tested from."""

    @property
    def candidates(self) -> int:
        """Episodes that are solved and verified."""
        return len(_passed(self.rows))


def import_set(
    home: Home,
    place: Path,
    config: StudyConfig,
    joints: str | None = None,
    dt: float | None = None,
    same_m: float = 1e-3,
) -> Imported:
    """Bring the set at `place` into the lake; nothing is written where PlancurateError is raised.

    The robot, the scene and how candidates are checked are the study's. A set that was brought in before with the
    same of them is found there. `joints` and `dt` are as for `read_set`, `same_m` as for `by_target`.
    """
    if not 0 < same_m < float("inf"):
        raise PlancurateError(f"--same-target: {same_m} m; a distance above 0 would be right")
    if len(config.scenes) > 1 or config.pools:
        raise PlancurateError(
            "import: one scene and no variants of candidates would be right; a set is played in one"
        )
    robot = load_robot(config.robot)
    recorded = read_set(place, robot, joints, dt)
    grouped = by_target(robot, recorded, same_m)
    name = set_id(grouped, same_m)
    decided = {
        "n_targets": len(grouped),
        "planners": [SOURCE],
        "candidates": {"targets": {"recorded": name}, "timing": {"dt": recorded.dt}},
    }
    study = open_study(StudyConfig.model_validate(merged(config.model_dump(mode="json"), decided)), home)
    (pool,) = study.pools
    pool.require_one_scene("import")
    rows = recorded_rows(pool.robot, pool.scene, grouped, pool.settings, same_m)
    if not len(_passed(rows)):
        raise PlancurateError(
            f"{place}: none of {len(rows)} episodes is a candidate; the first: {reason(rows)}"
        )
    home.require_writable()
    key = targets_key([target for target, _ in grouped])
    study.lake.write(
        "targets", pool.partition, key, target_rows([target for target, _ in grouped]), pool.metadata
    )
    study.lake.write("trajectories", {**pool.partition, "planner": SOURCE}, key, rows, pool.metadata)
    file = home.root / "imports" / f"{pool.pool}.yaml"
    file.parent.mkdir(exist_ok=True)
    content = study.config.model_dump(mode="json", include=DECIDED)
    file.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return Imported(name, file, pool, len(grouped), rows, _elsewhere(robot.home, grouped))


def reason(rows: pa.Table) -> str:
    """Why the first episode that is no candidate is none."""
    first = next(row for row in rows.to_pylist() if not (row["solved"] and row["verified"]))
    return str(first["reason"] or first["verify_reason"])


def _passed(rows: pa.Table) -> pa.Table:
    return rows.filter(pa.compute.and_(rows["solved"], rows["verified"]))


def _elsewhere(home: np.ndarray, grouped: Grouped) -> int:
    begins = np.array([episode.q[0] for _, episodes in grouped for episode in episodes])
    return int((np.abs(begins - home).max(axis=1) > 1e-3).sum())
