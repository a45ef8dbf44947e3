"""LeRobotDataset v3: the joint states and targets of its episodes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.dataset as ds

from plancurate.errors import PlancurateError
from plancurate.robots.robot import Robot
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.recorded import Episode, RecordedSet, tool_at
from plancurate.tasks.exports.joint_columns import joint_columns
from plancurate.tasks.exports.lerobot import VERSION

INFO = "meta/info.json"
STATE, BESIDE = "observation.state", "observation.environment_state"
OFFSET = tuple(f"target_offset_{k}" for k in range(3))


def read_lerobot(folder: Path, robot: Robot, joints: str | None, dt: float | None) -> RecordedSet:
    """Read the set of a folder; see `read_set`."""
    info = _info(folder)
    state = joints or STATE
    names, width = _columns(folder, info, state)
    order = joint_columns(f"{folder}: {state}", names, width, robot)
    beside, _ = _columns(folder, info, BESIDE) if BESIDE in info["features"] else ([], 0)
    told = set(OFFSET) <= set(beside)
    frames = _frames(folder, info, [state, *([BESIDE] if told else [])])
    q = _values(folder, frames, state)[:, order]
    offsets = _values(folder, frames, BESIDE)[:, [beside.index(name) for name in OFFSET]] if told else None
    ends = np.flatnonzero(np.diff(frames["episode_index"].to_numpy())) + 1
    bounds = [0, *ends.tolist(), len(q)]
    return RecordedSet(
        1 / info["fps"] if dt is None else dt,
        tuple(
            Episode(
                f"{folder}: episode {number}",
                q[begin:end],
                None if offsets is None else tool_at(robot, q[begin]) + offsets[begin],
            )
            for number, (begin, end) in enumerate(pairwise(bounds))
        ),
    )


def _info(folder: Path) -> Mapping[str, Any]:
    path = folder / INFO
    try:
        info: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        version, needed = info["codebase_version"], (info["fps"], info["features"], info["total_frames"])
    except (ValueError, KeyError, TypeError) as error:
        raise PlancurateError(f"{path}: not LeRobot's description of a data set: {error!r}") from None
    if version != VERSION:
        raise PlancurateError(
            f"{path}: codebase_version {version}; {VERSION} would be right, LeRobot converts it"
        )
    if not isinstance(needed[0], int | float) or needed[0] <= 0:
        raise PlancurateError(f"{path}: fps {needed[0]}; frames a second above 0 would be right")
    return info


def _columns(folder: Path, info: Mapping[str, Any], feature: str) -> tuple[list[str], int]:
    """Names of a feature's columns, none where the set gives none, and how many there are."""
    if feature not in info["features"]:
        raise PlancurateError(f"{folder}: no feature {feature} among {', '.join(info['features'])}")
    said = info["features"][feature]
    names = said.get("names") or []
    if isinstance(names, dict):  # by kind of motor
        names = [name for group in names.values() for name in group]
    return list(names), int(np.prod(said["shape"]))


def _frames(folder: Path, info: Mapping[str, Any], features: list[str]) -> pa.Table:
    """The features of all frames in order."""
    try:
        files = ds.dataset(sorted((folder / "data").glob("*/*.parquet")), format="parquet")
        frames = files.to_table(["index", "episode_index", *features]).sort_by("index")
    except (pa.ArrowException, OSError) as error:
        raise PlancurateError(f"{folder}/data: can't be read: {str(error).splitlines()[0]}") from None
    if len(frames) != info["total_frames"]:
        raise PlancurateError(f"{folder}/data: {len(frames)} frames, and {INFO} says {info['total_frames']}")
    return frames


def _values(folder: Path, frames: pa.Table, feature: str) -> FloatArray:
    """A feature's values (frames, k), rounded to float32."""
    column = frames[feature]
    if not pa.types.is_primitive(column.type):
        column = pc.list_flatten(column)
    if column.null_count or len(column) % max(len(frames), 1):
        raise PlancurateError(f"{folder}: {feature}: some frames lack values")
    return np.asarray(column.to_numpy(), np.float32).astype(np.float64).reshape(len(frames), -1)
