"""The pool: solved and verified candidates of a generated data set, with what identifies it."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pyarrow.compute as pc

from plancurate.errors import PlancurateError
from plancurate.tasks.lake.store import Lake

FloatArray = npt.NDArray[np.float64]
METRICS = ("joint_movement", "smoothness", "path_length")
# Waypoints that differ give other metrics or another end, so these stand for the content of a row.
_CONTENT = (
    *METRICS,
    "duration",
    "final_distance",
    "tool_x",
    "tool_y",
    "tool_z",
    "n_waypoints",
    "dt",
    "multiplicity",
)


@dataclass(frozen=True, eq=False)
class Pool:
    """Distinct candidates in order of target, planner and run, and their targets in order of id."""

    partition: Mapping[str, str]
    """robot, scene and pool of the lake."""
    candidates: pa.Table
    """Scalar columns; `multiplicity` says how many times the trajectory was found (copies are thinned to one)."""
    targets: pa.Table
    """target_id, x, y, z (m); every target asked for, also one that no candidate reaches."""
    hash: str
    """Of the ids and contents of the candidates and of the targets."""
    load_s: float = 0.0

    @property
    def n_targets(self) -> int:
        """Number of targets."""
        return int(self.targets.num_rows)

    def tool_positions(self) -> FloatArray:
        """Final tool positions (candidates, 3) in m."""
        return columns(self.candidates, ("tool_x", "tool_y", "tool_z"))

    def target_positions(self) -> FloatArray:
        """Positions (targets, 3) in m."""
        return columns(self.targets, ("x", "y", "z"))


def load_pool(
    lake: Lake,
    partition: Mapping[str, str],
    *,
    targets: Sequence[int] | None = None,
    planners: Sequence[str] | None = None,
    labelling: str | None = None,
    clock: Callable[[], float] = time.perf_counter,
) -> Pool:
    """Read a pool of the lake, for some targets and planners or (None) for all of them.

    Column `way` is that of a labelling (`StudyContext.labelling`), null without one.
    PlancurateError when a target is unknown or no candidate is solved and verified.
    """
    start = clock()
    wanted = None if targets is None else sorted(set(targets))
    known = lake.query("pool/targets", targets=wanted, **partition)
    if missing := set(wanted or ()) - set(known["target_id"].to_pylist()):
        raise PlancurateError(f"pool {partition['pool']}: target {min(missing)} was never generated")
    chosen = None if planners is None else sorted(set(planners))
    rows = lake.query("pool/candidates", targets=wanted, planners=chosen, labelling=labelling, **partition)
    pool = make_pool(partition, rows, known)
    return Pool(pool.partition, pool.candidates, pool.targets, pool.hash, clock() - start)


def make_pool(partition: Mapping[str, str], candidates: pa.Table, targets: pa.Table) -> Pool:
    """Order and identify candidates and targets, given in any order; PlancurateError for an empty pool."""
    if candidates.num_rows == 0:
        raise PlancurateError(
            f"pool {partition['pool']} of {partition['robot']} in {partition['scene']} is empty: "
            f"none of its trajectories to {targets.num_rows} targets is solved and verified"
        )
    ordered = candidates.sort_by([(name, "ascending") for name in ("target_id", "planner", "run")])
    targets = targets.sort_by("target_id")
    return Pool(partition, ordered.combine_chunks(), targets, _identity(ordered, targets))


def load_waypoints(lake: Lake, partition: Mapping[str, str], ids: Sequence[str]) -> list[FloatArray]:
    """Waypoints (m, joints) of each trajectory, in the order of ids; PlancurateError for an unknown id."""
    ends = {"first": min(ids, default=""), "last": max(ids, default="")}
    rows = lake.query("pool/waypoints", ids=list(ids), **ends, **partition)
    found = dict(zip(rows["trajectory_id"].to_pylist(), waypoint_arrays(rows["q"]), strict=True))
    if missing := [name for name in ids if name not in found]:
        raise PlancurateError(f"pool {partition['pool']}: no trajectory {missing[0]}")
    return [found[name] for name in ids]


def waypoint_arrays(q: pa.ChunkedArray) -> list[FloatArray]:
    """A column of list<list<float>> as one array (m, joints) a row."""
    ends = np.cumsum(pc.list_value_length(q).to_numpy()).tolist()
    waypoints = pc.list_flatten(q)
    if len(waypoints) == 0:
        return [np.empty((0, 0)) for _ in ends]
    numbers = pc.list_flatten(waypoints).to_numpy().astype(np.float64)
    rows = numbers.reshape(len(waypoints), -1)
    return [rows[start:end] for start, end in pairwise([0, *ends])]


def columns(rows: pa.Table, names: Sequence[str]) -> FloatArray:
    """Columns side by side (rows, names)."""
    return np.column_stack([rows[name].to_numpy() for name in names])


def _identity(candidates: pa.Table, targets: pa.Table) -> str:
    content = hashlib.sha256("\n".join(candidates["trajectory_id"].to_pylist()).encode())
    content.update(np.ascontiguousarray(columns(candidates, _CONTENT)).tobytes())
    if "way" in candidates.column_names:
        content.update("\n".join(way or "" for way in candidates["way"].to_pylist()).encode())
    content.update(np.ascontiguousarray(columns(targets, ("target_id", "x", "y", "z"))).tobytes())
    return content.hexdigest()[:12]
