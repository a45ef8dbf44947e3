"""Motions of the lake, by the ids of their trajectories."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from plancurate.errors import PlancurateError
from plancurate.robots import Robot
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.motion.motion import Motion, sampled


@dataclass(frozen=True)
class StoredTrajectory:
    """A solved trajectory, and where it was planned."""

    robot: str
    scene: str
    pool: str
    dt: float
    q: tuple[tuple[float, ...], ...]

    def motion(self, robot: Robot) -> Motion:
        """The trajectory as a motion of that robot."""
        return sampled(robot, np.array(self.q, dtype=np.float64), self.dt)


def stored_trajectory(lake: Lake, trajectory_id: str) -> StoredTrajectory:
    """Read a trajectory; PlancurateError for an id that the lake lacks or whose run was not solved."""
    rows = lake.query("motion/trajectory", trajectory_id=trajectory_id).to_pylist()
    if not rows:
        raise PlancurateError(
            f"{lake.root}: no trajectory '{trajectory_id}'; plancurate sql \"SELECT trajectory_id FROM trajectories\" "
            "lists what there is"
        )
    row = rows[0]
    if not row["solved"]:
        raise PlancurateError(f"trajectory {trajectory_id}: there is none, the run failed: {row['reason']}")
    return StoredTrajectory(row["robot"], row["scene"], row["pool"], row["dt"], tuple(map(tuple, row["q"])))
