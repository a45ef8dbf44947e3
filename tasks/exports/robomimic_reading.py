"""robomimic's HDF5: the joint states and targets of its demonstrations."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from plancurate.errors import PlancurateError
from plancurate.robots.robot import Robot
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.recorded import Episode, RecordedSet, tool_at
from plancurate.tasks.exports.episodes import JOINTS
from plancurate.tasks.exports.joint_columns import joint_columns
from plancurate.tasks.exports.robomimic import require_h5py

KNOWN = (JOINTS, "robot0_joint_pos")
"""What joint angles are called here and in robosuite."""
OFFSET = "target_offset"


def read_robomimic(path: Path, robot: Robot, joints: str | None, dt: float | None) -> RecordedSet:
    """Read the set of a file; see `read_set`."""
    try:
        with require_h5py().File(path) as file:
            if "data" not in file or not len(file["data"]):
                raise PlancurateError(f"{path}: no demonstrations in /data, as robomimic keeps them")
            said = _environment(path, file["data"])
            names = said.get("joints", [])
            demos = sorted(file["data"], key=lambda name: (len(name), name))  # demo_2 before demo_10
            episodes = tuple(
                _episode(f"{path}: {name}", file["data"][name], robot, joints, names) for name in demos
            )
    except OSError as error:
        raise PlancurateError(f"{path}: can't be read: {str(error).splitlines()[0]}") from None
    return RecordedSet(_dt(path, said) if dt is None else dt, episodes)


def _environment(path: Path, data: Any) -> Mapping[str, Any]:
    """What the file says of the world that it was recorded in."""
    try:
        return dict(json.loads(data.attrs.get("env_args", "{}")).get("env_kwargs", {}))
    except (ValueError, TypeError, AttributeError):
        raise PlancurateError(f"{path}: env_args of /data are not robomimic's JSON") from None


def _dt(path: Path, said: Mapping[str, Any]) -> float:
    """Seconds a frame: ours, or one by robosuite's frequency."""
    if said.get("dt") or said.get("control_freq"):
        return float(said["dt"]) if said.get("dt") else 1 / float(said["control_freq"])
    raise PlancurateError(f"{path}: nothing says how long a frame lasts; give it in seconds with --dt")


def _episode(name: str, demo: Any, robot: Robot, joints: str | None, names: list[str]) -> Episode:
    observed = demo.get("obs", {})
    key = joints or next((known for known in KNOWN if known in observed), KNOWN[0])
    if key not in observed:
        there = ", ".join(observed) or "nothing"
        raise PlancurateError(f"{name}: no joint positions obs/{key} among {there}; --joints names another")
    q = _values(f"{name}: obs/{key}", observed[key])
    q = q[:, joint_columns(f"{name}: obs/{key}", names, q.shape[1], robot)]
    if OFFSET not in observed:
        return Episode(name, q, None)
    offsets = _values(f"{name}: obs/{OFFSET}", observed[OFFSET])
    if len(offsets) != len(q) or offsets.shape[1] != 3:
        raise PlancurateError(f"{name}: obs/{OFFSET} is of shape {offsets.shape}, not ({len(q)}, 3)")
    return Episode(name, q, tool_at(robot, q[0]) + offsets[0])


def _values(where: str, values: Any) -> FloatArray:
    """Values (frames, k), rounded to float32."""
    if getattr(values, "ndim", 0) != 2 or values.dtype.kind not in "fiu":
        raise PlancurateError(f"{where}: rows of numbers are needed")
    return np.asarray(values[:]).astype(np.float32).astype(np.float64)
