"""Data sets of joint trajectories that LeRobot or robomimic wrote, as recorded episodes."""

from __future__ import annotations

from pathlib import Path

from plancurate.errors import PlancurateError
from plancurate.robots.robot import Robot
from plancurate.tasks.candidates.recorded import RecordedSet, require_sound
from plancurate.tasks.exports.lerobot_reading import INFO, read_lerobot
from plancurate.tasks.exports.robomimic_reading import read_robomimic


def read_set(place: Path, robot: Robot, joints: str | None = None, dt: float | None = None) -> RecordedSet:
    """Read a folder or an HDF5 file, each episode with the robot's joints in the robot's order.

    `joints` is the feature that holds them, where it has another name than usual; `dt`, s, what a frame lasts where
    the set does not say. PlancurateError for what is missing, damaged, of another version, or not this robot's.
    """
    if (place / INFO).is_file():
        recorded = read_lerobot(place, robot, joints, dt)
    else:
        recorded = read_robomimic(_hdf5(place), robot, joints, dt)
    require_sound(robot, recorded)
    return recorded


def _hdf5(place: Path) -> Path:
    files = [place] if place.is_file() else sorted(place.glob("*.hdf5"))
    if len(files) != 1:
        raise PlancurateError(
            f"{place}: {len(files)} files *.hdf5 and no {INFO}; a LeRobotDataset v3.0, or robomimic's file or a folder "
            "with one, would be right"
        )
    return files[0]
