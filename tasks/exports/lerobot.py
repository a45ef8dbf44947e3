"""LeRobotDataset v3: frames and episodes as Parquet, without images or videos."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from plancurate.errors import PlancurateError
from plancurate.tasks.exports.episodes import JOINTS, Episodes, Marks
from plancurate.tasks.exports.lerobot_statistics import episode_statistics, statistics

VERSION = "v3.0"
PART = "chunk-000/file-000.parquet"
Frames = Mapping[str, npt.NDArray[Any]]
"""Each feature's values, (frames,) or (frames, k)."""


def write_lerobot(episodes: Episodes, folder: Path) -> None:
    """Write the data set's files.

    `action` are the joint angles of the next frame, rad; the last one of an episode is to stay. PlancurateError where
    the frames are not a whole number a second.
    """
    fps = _fps(episodes.dt)
    tasks = list(dict.fromkeys(_tasks(episodes)))
    frames = _frames(episodes, fps, tasks)
    for name in ("data", "meta/episodes"):
        (folder / name / PART).parent.mkdir(parents=True)
    _write_frames(frames, episodes.lengths, folder / "data" / PART)
    pq.write_table(_episodes(episodes, frames), folder / "meta/episodes" / PART, compression="snappy")
    index = pd.Index(tasks, name="task")
    pd.DataFrame({"task_index": np.arange(len(tasks))}, index=index).to_parquet(folder / "meta/tasks.parquet")
    _write_json(_info(episodes, frames, fps, len(tasks)), folder / "meta/info.json")
    _write_json(statistics(frames), folder / "meta/stats.json")
    _write_json({marks.name: _curation(marks) for marks in episodes.marks}, folder / "meta/curation.json")


def _fps(dt: float) -> int:
    fps = round(1 / dt)
    if abs(fps * dt - 1) > 1e-6:
        raise PlancurateError(
            f"export to lerobot: a step lasts {dt} s, {1 / dt:.6g} frames a second, and LeRobot takes whole numbers; "
            "candidates of timing.dt 0.05 would be right"
        )
    return fps


def _tasks(episodes: Episodes) -> list[str]:
    """Each episode's task in words."""
    return [f"reach target {target}" for target in episodes.about["target_id"].to_pylist()]


def _frames(episodes: Episodes, fps: int, tasks: Sequence[str]) -> Frames:
    at, lengths, data = episodes.frames, episodes.lengths, episodes.data
    beside = [values[at] for name, values in episodes.terms() if name != JOINTS]
    number = np.concatenate([np.arange(length) for length in lengths])
    task = np.array([tasks.index(name) for name in _tasks(episodes)])
    return {
        "observation.state": data.q[at],
        **({"observation.environment_state": np.concatenate(beside, axis=1)} if beside else {}),
        "action": data.q[at + 1],
        **{f"keep.{marks.name}": marks.steps for marks in episodes.marks if marks.steps is not None},
        "timestamp": (number / fps).astype(np.float32),
        "frame_index": number,
        "episode_index": np.repeat(np.arange(len(lengths)), lengths),
        "index": np.arange(len(at)),
        "task_index": np.repeat(task, lengths),
    }


def _names(episodes: Episodes) -> dict[str, list[str]]:
    """What the columns of the features are called that have several."""
    joints = list(episodes.robot.joint_names)
    beside = [f"{name}_{k}" for name, size in episodes.data.layout if name != JOINTS for k in range(size)]
    return {"observation.state": joints, "observation.environment_state": beside, "action": joints}


def _info(episodes: Episodes, frames: Frames, fps: int, n_tasks: int) -> dict[str, Any]:
    names = _names(episodes)
    return {
        "codebase_version": VERSION,
        "robot_type": episodes.robot.name,
        "total_episodes": len(episodes.about),
        "total_frames": len(frames["index"]),
        "total_tasks": n_tasks,
        "chunks_size": 1000,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": fps,
        "splits": {"train": f"0:{len(episodes.about)}"},
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        "video_path": None,
        "features": {
            name: {
                "dtype": str(values.dtype),
                "shape": list(values.shape[1:]) or [1],
                "names": names.get(name),
            }
            for name, values in frames.items()
        },
    }


def _write_frames(frames: Frames, lengths: npt.NDArray[np.int64], path: Path) -> None:
    """One row group an episode, so that a reader of some episodes skips the others."""
    table = pa.table({name: _column(values) for name, values in frames.items()})
    with pq.ParquetWriter(path, table.schema, compression="snappy") as writer:
        for start, length in zip(np.cumsum(lengths) - lengths, lengths, strict=True):
            writer.write_table(table.slice(start, length), row_group_size=length)


def _column(values: npt.NDArray[Any]) -> pa.Array:
    """A feature of one number as it is, one of several as lists of fixed length."""
    if values.ndim == 1 or values.shape[1] == 1:
        return pa.array(values.reshape(len(values)))
    return pa.FixedSizeListArray.from_arrays(pa.array(values.ravel()), values.shape[1])


def _episodes(episodes: Episodes, frames: Frames) -> pa.Table:
    lengths = episodes.lengths
    ends, zeros = np.cumsum(lengths), np.zeros(len(lengths), np.int64)
    rows = {
        "episode_index": np.arange(len(lengths)),
        "tasks": [[task] for task in _tasks(episodes)],
        "length": lengths,
        "data/chunk_index": zeros,
        "data/file_index": zeros,
        "dataset_from_index": ends - lengths,
        "dataset_to_index": ends,
        "meta/episodes/chunk_index": zeros,
        "meta/episodes/file_index": zeros,
        **dict(zip(episodes.about.column_names, episodes.about.columns, strict=True)),
    }
    for marks in episodes.marks:
        selector = pa.repeat(pa.scalar(marks.selection.selector), len(lengths))
        rows[f"selector/{marks.name}"] = selector
        rows |= {f"{name}/{marks.name}": marks.rows[name] for name in marks.rows.column_names}
    return pa.table(rows | episode_statistics(frames, lengths))


def _curation(marks: Marks) -> dict[str, Any]:
    selection = marks.selection
    same = ("selector", "budget", "seed", "params", "pool_hash", "n_pool")
    return {name: getattr(selection, name) for name in same} | {"episodes": marks.kept}


def _write_json(content: Mapping[str, Any], path: Path) -> None:
    path.write_text(json.dumps(content, indent=4, default=dict), encoding="utf-8")
