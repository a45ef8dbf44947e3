"""Statistics that LeRobot normalises by: of every feature, over all frames and over those of each episode."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}


def statistics(frames: Mapping[str, npt.NDArray[Any]]) -> dict[str, dict[str, list[float]]]:
    """Of each feature by name: smallest, largest, mean, standard deviation, quantiles and number of its frames."""
    return {name: _statistics(values) for name, values in frames.items()}


def episode_statistics(
    frames: Mapping[str, npt.NDArray[Any]], lengths: npt.NDArray[np.int64]
) -> dict[str, list[list[float]]]:
    """The same of each episode's frames, as columns `stats/<feature>/<statistic>`."""
    found: dict[str, list[list[float]]] = {}
    for name, values in frames.items():
        for part in np.split(values, np.cumsum(lengths)[:-1]):
            for statistic, value in _statistics(part).items():
                found.setdefault(f"stats/{name}/{statistic}", []).append(value)
    return found


def _statistics(values: npt.NDArray[Any]) -> dict[str, list[float]]:
    columns = values.reshape(len(values), -1).astype(np.float64)
    quantiles = np.quantile(columns, list(QUANTILES.values()), axis=0).tolist()
    return {
        "min": columns.min(axis=0).tolist(),
        "max": columns.max(axis=0).tolist(),
        "mean": columns.mean(axis=0).tolist(),
        "std": columns.std(axis=0).tolist(),
        "count": [len(columns)],
        **dict(zip(QUANTILES, quantiles, strict=True)),
    }
