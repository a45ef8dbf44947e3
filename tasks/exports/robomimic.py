"""robomimic's format: one HDF5 file with a demonstration an episode and a mask a selection."""

from __future__ import annotations

import importlib
import json
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt

from plancurate import __version__
from plancurate.errors import PlancurateError
from plancurate.tasks.exports.episodes import Episodes, Marks

FILE = "demonstrations.hdf5"
GYM = 2  # robomimic's number for environments that are neither robosuite's nor iGibson's


def require_h5py() -> ModuleType:
    """The library that writes HDF5; PlancurateError where it is not installed."""
    try:
        return importlib.import_module("h5py")
    except ImportError:
        raise PlancurateError(
            "export to robomimic: h5py is missing; pip install 'plancurate[exports]'"
        ) from None


def write_robomimic(episodes: Episodes, folder: Path) -> None:
    """Write folder/demonstrations.hdf5.

    An action is the change of the joint angles until the next frame as a share of `action_scale`, an attribute of
    /data, hence within [-1, 1]; the last one of a demonstration is to stay.
    """
    scale = action_scale(episodes)
    with require_h5py().File(folder / FILE, "w") as file:
        data = file.create_group("data")
        data.attrs["total"] = int(episodes.lengths.sum())
        data.attrs["action_scale"] = scale
        data.attrs["env_args"] = json.dumps(environment(episodes, scale))
        for number, about in enumerate(episodes.about.to_pylist()):
            _write_demonstration(data.create_group(f"demo_{number}"), episodes, number, about, scale)
        for marks in episodes.marks:
            _write_mask(file, marks)


def action_scale(episodes: Episodes) -> npt.NDArray[np.float32]:
    """(n,): how far each joint's velocity lets it go between two frames, rad (m for a sliding joint)."""
    allowed = (episodes.robot.velocity * episodes.dt).astype(np.float32)
    largest = np.abs(episodes.data.actions).max(axis=0)  # rounding may put it beyond
    return np.asarray(np.maximum(allowed, largest))


def environment(episodes: Episodes, scale: npt.NDArray[np.float32]) -> Mapping[str, Any]:
    """What robomimic calls the environment's metadata; `type` is what its code reads."""
    return {
        "env_name": f"plancurate-{episodes.robot.name}-{episodes.scene.name}",
        "env_version": __version__,
        "type": GYM,
        "env_kwargs": {
            "robot": episodes.robot.name,
            "scene": episodes.scene.name,
            "joints": list(episodes.robot.joint_names),
            "dt": episodes.dt,
            "action_scale": scale.tolist(),
        },
    }


def _write_demonstration(
    group: Any, episodes: Episodes, number: int, about: Mapping[str, Any], scale: npt.NDArray[np.float32]
) -> None:
    data, length = episodes.data, int(episodes.lengths[number])
    frames = slice(data.starts[number], data.starts[number] + length)
    following = slice(frames.start + 1, frames.stop + 1)
    last = np.arange(length) == length - 1
    group.attrs["num_samples"] = length
    group.attrs.update({name: value for name, value in about.items() if value is not None})
    group.create_dataset("actions", data=data.actions[frames] / scale)
    group.create_dataset("rewards", data=last.astype(np.float32))
    group.create_dataset("dones", data=last.astype(np.int64))
    for term, values in episodes.terms():
        group.create_dataset(f"obs/{term}", data=values[frames])
        group.create_dataset(f"next_obs/{term}", data=values[following])
    first = int(episodes.lengths[:number].sum())
    for marks in episodes.marks:
        if marks.steps is not None:
            group.create_dataset(
                f"keep/{marks.name}", data=marks.steps[first : first + length].astype(np.uint8)
            )


def _write_mask(file: Any, marks: Marks) -> None:
    names = np.array([f"demo_{number}" for number in marks.kept], dtype="S")
    mask = file.create_dataset(f"mask/{marks.name}", data=names)
    selection, rows = marks.selection, marks.rows.take(marks.kept)
    mask.attrs.update({"selector": selection.selector, "params": json.dumps(selection.params)})
    if selection.budget is not None:
        mask.attrs["budget"] = selection.budget
    for name in ("score", "rank", "weight"):
        if not rows[name].null_count:
            file.create_dataset(f"curation/{marks.name}/{name}", data=rows[name].to_numpy())
