"""Motions as files: CSV, Parquet, NumPy, and ROS's JointTrajectory in YAML or JSON; told apart by their ending.

Tables have a column `time` (s) and one for each joint, named as the joint; velocities and accelerations, where there
are any, are columns `velocity:JOINT` and `acceleration:JOINT`. An array file `.npz` holds `times`, `positions` and,
where there are any, `velocities`, `accelerations` and `joint_names`; `.npy` holds rows of the time and positions.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.motion.motion import Motion
from plancurate.tasks.motion.ros_trajectory import read_ros, write_ros

TIME = "time"
PREFIXES = {"velocities": "velocity:", "accelerations": "acceleration:"}
ARRAYS = ("times", "positions", "velocities", "accelerations", "joint_names")


def read_motion(file: Path) -> Motion:
    """Read a motion; PlancurateError for a file that holds none. Values are not judged here."""
    reader, _ = format_of(file)
    if not file.is_file():
        raise PlancurateError(f"{file}: no such file; a motion in {', '.join(FORMATS)} would be right")
    return reader(file)


def write_motion(file: Path, motion: Motion) -> None:
    """Write a motion whose joints are named, as `read_motion` reads it."""
    _, writer = format_of(file)
    writer(file, motion)


def format_of(file: Path) -> tuple[Callable[[Path], Motion], Callable[[Path, Motion], None]]:
    """How a file of that name is read and written; PlancurateError for another ending."""
    ending = file.suffix.lower()
    if ending not in FORMATS:
        raise PlancurateError(f"{file}: {UnknownNameError('ending', ending, FORMATS)}")
    return FORMATS[ending]


def read_csv(file: Path) -> Motion:
    """Read a table with a header."""
    try:
        return of_table(file, pyarrow.csv.read_csv(file))
    except pa.ArrowInvalid as error:
        raise PlancurateError(f"{file}: not a CSV table: {first_line(error)}") from None


def read_parquet(file: Path) -> Motion:
    """Read a table."""
    try:
        return of_table(file, pyarrow.parquet.read_table(file))
    except pa.ArrowInvalid as error:
        raise PlancurateError(f"{file}: not a Parquet table: {first_line(error)}") from None


def of_table(file: Path, table: pa.Table) -> Motion:
    """A table's columns as a motion."""
    names = table.column_names
    if TIME not in names:
        found = ", ".join(names[:8])
        raise PlancurateError(f"{file}: column '{TIME}' is missing, among {found}; the others are joints'")
    others = [name for name in names if name != TIME]
    joints = [name for name in others if not name.startswith(tuple(PREFIXES.values()))]
    derived = {
        field: columns(file, table, [prefix + joint for joint in joints])
        for field, prefix in PREFIXES.items()
        if any(name.startswith(prefix) for name in others)
    }
    return Motion(
        columns(file, table, [TIME])[:, 0], columns(file, table, joints), joint_names=tuple(joints), **derived
    )


def columns(file: Path, table: pa.Table, names: list[str]) -> FloatArray:
    """Columns (m, k) as numbers; an empty field is no number."""
    found = []
    for name in names:
        if table.column_names.count(name) != 1:
            raise PlancurateError(
                f"{file}: column '{name}' is there {table.column_names.count(name)} times, not once"
            )
        try:
            found.append(table[name].cast(pa.float64()).to_numpy())
        except pa.ArrowInvalid as error:
            raise PlancurateError(f"{file}: column '{name}' holds no numbers: {first_line(error)}") from None
    return np.stack(found, axis=1) if found else np.empty((len(table), 0))


def to_table(motion: Motion) -> pa.Table:
    """A motion as a table."""
    joints = motion.joint_names or ()
    content = {TIME: motion.times, **dict(zip(joints, motion.positions.T, strict=True))}
    for field, prefix in PREFIXES.items():
        if (values := getattr(motion, field)) is not None:
            content |= {prefix + joint: column for joint, column in zip(joints, values.T, strict=True)}
    return pa.table(content)


def read_array(file: Path) -> Motion:
    """Read rows (m, 1 + n) of time and positions."""
    rows = loaded(file)
    if not isinstance(rows, np.ndarray) or rows.ndim != 2 or rows.shape[1] < 2:
        raise PlancurateError(f"{file}: rows of a time and joint positions are needed, shape (m, 1 + n)")
    rows = numbers(file, "rows", rows)
    return Motion(rows[:, 0], rows[:, 1:])


def read_arrays(file: Path) -> Motion:
    """Read named arrays."""
    arrays = loaded(file)
    if not isinstance(arrays, np.lib.npyio.NpzFile):
        raise PlancurateError(
            f"{file}: holds a single array; named arrays as np.savez writes them are needed"
        )
    with arrays:
        for name in arrays.files:
            if name not in ARRAYS:
                raise PlancurateError(f"{file}: {UnknownNameError('array', name, ARRAYS)}")
        for name in ARRAYS[:2]:
            if name not in arrays.files:
                raise PlancurateError(
                    f"{file}: array '{name}' is missing; times (m,) and positions (m, n) are needed"
                )
        try:
            content = {name: arrays[name] for name in arrays.files}
        except ValueError as error:
            raise PlancurateError(f"{file}: {first_line(error)}") from None
    names = content.pop("joint_names", None)
    values = {name: numbers(file, name, value) for name, value in content.items()}
    if values["times"].ndim != 1 or values["positions"].ndim != 2:
        raise PlancurateError(f"{file}: times must be (m,) and positions (m, n)")
    return Motion(**values, joint_names=None if names is None else tuple(map(str, names.tolist())))


def loaded(file: Path) -> npt.NDArray[np.generic] | np.lib.npyio.NpzFile:
    """What NumPy finds in a file, without unpickling anything."""
    try:
        found: npt.NDArray[np.generic] | np.lib.npyio.NpzFile = np.load(file, allow_pickle=False)
    except (ValueError, EOFError, OSError) as error:
        raise PlancurateError(f"{file}: not a NumPy file of plain numbers: {first_line(error)}") from None
    return found


def numbers(file: Path, name: str, values: npt.NDArray[np.generic]) -> FloatArray:
    """An array in float64."""
    if values.dtype.kind not in "fiu":
        raise PlancurateError(f"{file}: {name} is of type {values.dtype}; numbers are needed")
    return values.astype(np.float64)


def write_array(file: Path, motion: Motion) -> None:
    """Write rows of time and positions; NumPy's own format has no place for more."""
    np.save(file, np.column_stack([motion.times, motion.positions]))


def write_arrays(file: Path, motion: Motion) -> None:
    """Write all that there is as named arrays."""
    content = {name: getattr(motion, name) for name in ARRAYS}
    kept: dict[str, Any] = {name: np.array(value) for name, value in content.items() if value is not None}
    np.savez(file, **kept)


def first_line(error: Exception) -> str:
    """What a library says, in one line."""
    return str(error).splitlines()[0] if str(error) else type(error).__name__


FORMATS: dict[str, tuple[Callable[[Path], Motion], Callable[[Path, Motion], None]]] = {
    ".csv": (read_csv, lambda file, motion: pyarrow.csv.write_csv(to_table(motion), file)),
    ".parquet": (read_parquet, lambda file, motion: pyarrow.parquet.write_table(to_table(motion), file)),
    ".npy": (read_array, write_array),
    ".npz": (read_arrays, write_arrays),
    ".yaml": (read_ros, write_ros),
    ".yml": (read_ros, write_ros),
    ".json": (read_ros, write_ros),
}
