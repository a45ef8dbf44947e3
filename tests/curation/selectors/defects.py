"""A pool with known defects, to see which of them a selector finds.

`defective_pool` makes, in memory, `per_target` candidates to each of a few targets of the H2017: smooth paths
in joint space from home, sampled every DT at a speed that hardly varies, and puts `share` of each defect among
them, in random places. A `Bed` holds the pool, reads waypoints like a lake does, and knows what is wrong:

    bed = defective_pool(seed=0)
    selection = chosen(bed, name, budget=5)
    auroc(bed, badness, "stall")  # badness (candidates,): higher is worse, in the order of the pool

The defects are

`detour`        the path swings far out on its way
`reversal`      it goes back part of its way and comes again
`duplicate`     it is an exact copy of a clean candidate to the same target (`Bed.twin` says of which)
`stall`         the robot stands still for a while on its way
`wrong_target`  it leads to another target than the one it is listed under
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import duckdb
import numpy as np
import numpy.typing as npt
import pyarrow as pa
from sklearn.metrics import roc_auc_score

from plancurate import native
from plancurate.robots import load_robot, load_scene
from plancurate.tasks.candidates.time_parameterisation import TimingSettings
from plancurate.tasks.curation.learning_settings import LearningSettings
from plancurate.tasks.curation.pool import Pool, make_pool
from plancurate.tasks.curation.selectors.base import Problem, Stopwatch
from plancurate.tasks.curation.selectors.selection import Selection, select
from plancurate.tasks.learning.settings import EvaluateSettings, TrainSettings

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

ROBOT, SCENE = load_robot("h2017"), load_scene("free")
# Named, not the defaults of today: what is pinned must not change with them.
TRAINING = TrainSettings(weight_decay=1.0, policies={"BC_MLP": {"hidden": [128, 128]}})
LEARNING = LearningSettings(TRAINING, EvaluateSettings(), TimingSettings())
CLEAN = "clean"
DEFECTS = ("detour", "reversal", "duplicate", "stall", "wrong_target")
DT = 0.05  # s
SPEED = 0.4  # rad/s, of the norm of all joints: a clean motion takes about 3 s


@dataclass(frozen=True, eq=False)
class Bed:
    """A pool and what is wrong with it; arrays are in the order of the pool's candidates."""

    pool: Pool
    paths: list[FloatArray]
    """Waypoints (m, 6), rad, of each candidate."""
    label: npt.NDArray[np.str_]
    """(candidates,): CLEAN or one of DEFECTS."""
    onset: IntArray
    """(candidates,): waypoint at which a stall or reversal begins, -1 elsewhere."""
    length: IntArray
    """(candidates,): waypoints that the stall or reversal adds, 0 elsewhere."""
    twin: IntArray
    """(candidates,): row of the candidate that a duplicate copies, -1 elsewhere."""

    @property
    def target(self) -> IntArray:
        """Target id (candidates,) that each candidate is listed under."""
        return self.pool.candidates["target_id"].to_numpy().astype(np.int64)

    def waypoints(self, ids: Sequence[str]) -> list[FloatArray]:
        """Waypoints (m, 6) of candidates by trajectory id, as `Problem.waypoints` gives them."""
        names = self.pool.candidates["trajectory_id"].to_pylist()
        by_id = dict(zip(names, self.paths, strict=True))
        return [by_id[name] for name in ids]


def problem(bed: Bed, budget: int = 1, seed: int = 0) -> Problem:
    """The bed's pool as selectors get it, for tests of what they do inside."""
    connection = duckdb.connect()
    rows = pa.array(np.arange(len(bed.paths)))
    connection.register("candidates", bed.pool.candidates.append_column("row", rows))
    watch = Stopwatch(time.perf_counter)
    return Problem(bed.pool, budget, seed, connection, watch, ROBOT, SCENE, bed.waypoints, LEARNING)


def chosen(bed: Bed, name: str, budget: int | None, seed: int = 0, **params: object) -> Selection:
    """Select from the bed's pool without a lake."""
    return select(
        name, bed.pool, budget, seed, params,
        robot=ROBOT, scene=SCENE, waypoints=bed.waypoints, learning=LEARNING,
    )  # fmt: skip


def auroc(bed: Bed, badness: FloatArray, defect: str) -> float:
    """Chance that a candidate with the defect has a higher badness (candidates,) than a clean one."""
    rows = np.isin(bed.label, [CLEAN, defect])
    return float(roc_auc_score(bed.label[rows] == defect, badness[rows]))


def bed_of(paths: Sequence[FloatArray], target: IntArray, positions: FloatArray) -> Bed:
    """A bed of clean paths (m, 6) listed under target (paths,), in ascending order, for pools made by hand."""
    if np.any(np.diff(target) < 0):
        raise ValueError("paths must be given in order of their targets, as the pool has them")
    none, label = np.full(len(paths), -1), np.full(len(paths), CLEAN)
    return Bed(pool_of(paths, target, positions), list(paths), label, none, none * 0, none)


def defective_pool(seed: int = 0, targets: int = 6, per_target: int = 30, share: float = 0.1) -> Bed:
    """Make a pool of `targets` x `per_target` candidates, `share` of them with each defect of DEFECTS."""
    rng = np.random.default_rng(seed)
    goals = ROBOT.home + far_offsets(rng, targets)
    each = round(share * per_target)
    labels = [CLEAN] * (per_target - each * len(DEFECTS)) + [d for d in DEFECTS for _ in range(each)]
    label = np.concatenate([rng.permutation(labels) for _ in range(targets)])
    made = [_candidate(rng, goals, row // per_target, name) for row, name in enumerate(label)]
    paths = [path for path, _, _ in made]
    twin = np.full(len(label), -1)
    for row in np.flatnonzero(label == "duplicate"):
        first = row - row % per_target
        twin[row] = first + rng.choice(np.flatnonzero(label[first : first + per_target] == CLEAN))
        paths[row] = paths[twin[row]].copy()
    onset, length = np.array([(onset, length) for _, onset, length in made]).T
    pool = pool_of(paths, np.arange(len(label)) // per_target, tool_positions(goals))
    return Bed(pool, paths, label, onset, length, twin)


def far_offsets(rng: np.random.Generator, targets: int) -> FloatArray:
    """Joint offsets (targets, 6) from home of about 1.2 rad, no two of them alike."""
    offsets = rng.normal(size=(targets, ROBOT.dof))
    return np.asarray(
        offsets / np.linalg.norm(offsets, axis=1, keepdims=True) * rng.uniform(1, 1.4, (targets, 1))
    )


def curve(via: FloatArray, speed: float = SPEED) -> FloatArray:
    """Waypoints (m, 6), DT apart, of the Bezier curve with control points via (v, 6) at constant speed (rad/s)."""
    t = np.linspace(0, 1, 400)[:, None]
    points = list(via)
    while len(points) > 1:
        points = [(1 - t) * a + t * b for a, b in pairwise(points)]
    fine = points[0]
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))])
    steps = max(2, round(along[-1] / speed / DT))
    return np.column_stack([np.interp(np.linspace(0, along[-1], steps + 1), along, q) for q in fine.T])


def stalled(path: FloatArray, at: int, steps: int) -> FloatArray:
    """Waypoints (m, 6) that stand still for `steps` more steps at waypoint `at`."""
    return np.concatenate([path[:at], np.repeat(path[at : at + 1], steps + 1, axis=0), path[at + 1 :]])


def reversed_and_returned(path: FloatArray, at: int, steps: int) -> FloatArray:
    """Waypoints (m, 6) that go back `steps` steps from waypoint `at`, then on again."""
    return np.concatenate([path[: at + 1], path[at - steps : at][::-1], path[at - steps + 1 :]])


def pool_of(paths: Sequence[FloatArray], target: IntArray, positions: FloatArray) -> Pool:
    """The pool of paths (m, 6) listed under target (paths,), with the targets at positions (targets, 3), m."""
    tools = np.stack([tool_positions(path)[-1] for path in paths])
    run = [int(np.sum(target[:row] == target[row])) for row in range(len(paths))]
    steps = [np.diff(path, axis=0) for path in paths]
    columns = {
        "trajectory_id": [f"t{t:04d}-RRT-r{r:03d}" for t, r in zip(target, run, strict=True)],
        "target_id": pa.array(target, pa.int32()), "planner": ["RRT"] * len(paths),
        "run": pa.array(run, pa.int32()), "goal_index": pa.array(np.zeros(len(paths)), pa.int32()),
        **dict(zip(("tool_x", "tool_y", "tool_z"), tools.T, strict=True)),
        "joint_movement": [np.abs(s).sum() for s in steps],
        "smoothness": [np.linalg.norm(np.diff(s, axis=0), axis=1).sum() / DT**2 for s in steps],
        "path_length": [np.linalg.norm(np.diff(tool_positions(p), axis=0), axis=1).sum() for p in paths],
        "duration": [len(s) * DT for s in steps],
        "final_distance": np.linalg.norm(tools - positions[target], axis=1),
        "n_waypoints": pa.array([len(path) for path in paths], pa.int32()), "dt": np.full(len(paths), DT),
        "multiplicity": np.ones(len(paths), dtype=np.int64),
    }  # fmt: skip
    ids = pa.array(np.arange(len(positions)), pa.int32())
    places = pa.table({"target_id": ids, **dict(zip("xyz", positions.T, strict=True))})
    return make_pool({"robot": "h2017", "scene": "free", "pool": "0a1b2c"}, pa.table(columns), places)


def tool_positions(q: FloatArray) -> FloatArray:
    """Tool positions (b, 3), m, at joint angles q (b, 6)."""
    return np.asarray(native.fk(ROBOT.native, np.ascontiguousarray(q))[:, :3, 3])


def _candidate(
    rng: np.random.Generator, goals: FloatArray, target: int, label: str
) -> tuple[FloatArray, int, int]:
    """Waypoints, and onset and length of a stall or reversal (-1 and 0 for other labels)."""
    others = np.delete(np.arange(len(goals)), target)
    goal = goals[rng.choice(others)] if label == "wrong_target" else goals[target]
    if label == "detour":
        via = (ROBOT.home + goal) / 2 + rng.uniform(0.8, 1.6) * far_offsets(rng, 2)
    else:
        via = (ROBOT.home + goal) / 2 + rng.normal(0, 0.1, (2, ROBOT.dof))
    path = curve(np.concatenate([ROBOT.home[None], via, goal[None]]), SPEED * rng.uniform(0.9, 1.1))
    if label not in ("stall", "reversal"):
        return path, -1, 0
    at = int(rng.integers(len(path) // 3, 3 * len(path) // 4))
    if label == "stall":
        steps = int(rng.integers(15, 40))
        return stalled(path, at, steps), at, steps
    steps = int(rng.integers(len(path) // 6, len(path) // 3))
    return reversed_and_returned(path, at, steps), at, 2 * steps
