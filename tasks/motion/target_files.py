"""Targets from a file, and motions to them into files."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from plancurate.errors import PlancurateError
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.motion.predict import Prediction
from plancurate.tasks.motion.trajectory_files import write_motion


def read_targets(file: Path) -> FloatArray:
    """Read targets (t, 3), m, of a CSV file with columns x, y and z; PlancurateError for one without."""
    try:
        with file.open(newline="", encoding="utf-8") as lines:
            rows = list(csv.DictReader(lines))
    except OSError as error:
        raise PlancurateError(
            f"{file}: cannot be read: {error.strerror}; a CSV file with columns x, y and z is needed"
        ) from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise PlancurateError(f"{file}: not a CSV table: {error}") from None
    if not rows:
        raise PlancurateError(
            f"{file}: holds no targets; a line x,y,z and a line of numbers for each are needed"
        )
    return np.array(
        [[coordinate(file, number, row, axis) for axis in "xyz"] for number, row in enumerate(rows)]
    )


def coordinate(file: Path, number: int, row: dict[str, str], axis: str) -> float:
    """One coordinate of a target."""
    try:
        return float(row[axis])
    except (KeyError, TypeError, ValueError):
        raise PlancurateError(
            f"{file}: target {number}: {axis} = {row.get(axis)}; a number in m would be right"
        ) from None


def write_predictions(out: Path, predictions: Sequence[Prediction]) -> list[Path | None]:
    """Write motions into files named after `out`, each with its target's number; returns them, None without one."""
    return [
        write_prediction(out.with_stem(f"{out.stem}-{number:04d}"), prediction)
        for number, prediction in enumerate(predictions)
    ]


def write_prediction(out: Path, prediction: Prediction) -> Path | None:
    """Write a motion, if there is one; returns the file."""
    if prediction.motion is None:
        return None
    write_motion(out, prediction.motion)
    return out
