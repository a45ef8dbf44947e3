"""Tables of the lake: columns, folder levels and what tells rows apart. Nothing else defines a column."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import pyarrow as pa

from plancurate.errors import UnknownNameError

PART_PATTERN = "part-*.parquet"
SCHEMA_VERSION = 6  # raise it with every change below: older parts are then refused, not misread


@dataclass(frozen=True)
class Table:
    """One table: `schema` is what a part file holds, `partition` are the folder levels above it."""

    name: str
    partition: tuple[str, ...]
    identity: tuple[str, ...]  # columns that tell two rows of one partition apart
    schema: pa.Schema

    @property
    def pattern(self) -> str:
        """Where its parts lie below the table's folder."""
        return "/".join([*(f"{level}=*" for level in self.partition), PART_PATTERN])

    @property
    def full_schema(self) -> pa.Schema:
        """The partition's columns (strings) followed by those of the file."""
        return pa.schema([_required(name, pa.string()) for name in self.partition] + list(self.schema))


def table(name: str) -> Table:
    """The table of that name; UnknownNameError otherwise."""
    if name not in TABLES:
        raise UnknownNameError("table", name, TABLES)
    return TABLES[name]


def _required(name: str, kind: pa.DataType) -> pa.Field:
    return pa.field(name, kind, nullable=False)


def _schema(required: Mapping[str, pa.DataType], optional: Mapping[str, pa.DataType]) -> pa.Schema:
    """Columns in the order given: those that always hold a value, then those that may be null."""
    fields = [_required(name, kind) for name, kind in required.items()]
    return pa.schema(fields + [pa.field(name, kind) for name, kind in optional.items()])


_TEXT, _INT, _LONG, _BOOL, _REAL = pa.string(), pa.int32(), pa.int64(), pa.bool_(), pa.float64()

# One row an attempt; `q` is (waypoints, joints) in rad or m at steps of `dt` seconds, empty when not solved.
_TRAJECTORIES = _schema(
    {
        "trajectory_id": _TEXT, "target_id": _INT, "run": _INT, "seed": _LONG,
        "status": _TEXT, "reason": _TEXT, "solved": _BOOL, "termination": _TEXT,
        "state_checks": _LONG, "motion_checks": _LONG,
        "goal_index": _INT, "n_path_waypoints": _INT, "timing_method": _TEXT,
        "target_x": _REAL, "target_y": _REAL, "target_z": _REAL,
        "n_waypoints": _INT, "verified": _BOOL,
        "plan_s": _REAL, "timing_s": _REAL, "verify_s": _REAL,
        "dt": _REAL, "q": pa.list_(pa.list_(pa.float32())),
    },
    {
        "tool_x": _REAL, "tool_y": _REAL, "tool_z": _REAL,
        "joint_movement": _REAL, "smoothness": _REAL, "path_length": _REAL,
        "duration": _REAL, "final_distance": _REAL,
        "max_tracking_error_rad": _REAL, "final_tracking_error_m": _REAL,
        "contacts": _INT, "saturated_share": _REAL, "verify_reason": _TEXT,
        "goal": pa.list_(_REAL), "min_clearance": _REAL,
    },
)  # fmt: skip

_TARGETS = _schema(
    {"target_id": _INT, "x": _REAL, "y": _REAL, "z": _REAL, "goals": pa.list_(pa.list_(_REAL))}, {}
)

# One row a run, labelled beside all runs of the same sources to its target; `way` is null for one without a
# verified trajectory.
_WAYS = _schema({"trajectory_id": _TEXT, "target_id": _INT}, {"way": _TEXT})

# One row a kept trajectory. `steps`, `weight` and `q` are null for one that is learnt from whole and as it is.
_SELECTIONS = _schema(
    {
        "selection_id": _TEXT, "selector": _TEXT, "seed": _INT, "pool_hash": _TEXT, "n_targets": _INT,
        "params": _TEXT,
        "trajectory_id": _TEXT, "target_id": _INT, "planner": _TEXT, "goal_index": _INT, "n_pool": _INT,
        "prepare_s": _REAL, "base_policy_s": _REAL, "rollouts_s": _REAL, "cluster_s": _REAL, "score_s": _REAL,
        "select_s": _REAL, "selection_time_s": _REAL,
    },
    {
        "budget": _INT, "cluster": _INT, "score": _REAL, "rank": _INT,
        "steps": pa.list_(_INT), "weight": _REAL, "q": pa.list_(pa.list_(pa.float32())),
    },
)  # fmt: skip

# One row a selection whose scores are estimated from rollouts.
_RANKINGS = _schema({"selection_id": _TEXT, "split_half": _REAL}, {})

# One row a path by which a network of this round is corrected; `parent` is the network of the round before, which was
# in the path's first state after `step` moves toward a training target. `failure` is empty where that went well.
_CORRECTIONS = _schema(
    {
        "correction_id": _TEXT, "network_id": _TEXT, "parent": _TEXT, "round": _INT, "selection_id": _TEXT,
        "policy": _TEXT, "seed": _INT, "target_id": _INT, "step": _INT, "failure": _TEXT,
        "q": pa.list_(pa.list_(pa.float32())),
    },
    {},
)  # fmt: skip

# One row a trial of a policy, after as many rounds of corrections.
_EVALUATIONS = _schema(
    {
        "evaluation_id": _TEXT, "selection_id": _TEXT, "selector": _TEXT, "selection_seed": _INT,
        "policy": _TEXT, "seed": _INT, "round": _INT, "n_kept": _INT, "selection_time_s": _REAL, "train_s": _REAL,
        "test_id": _INT, "kind": _TEXT, "x": _REAL, "y": _REAL, "z": _REAL, "hard": _BOOL,
        "success": _BOOL, "settled": _BOOL, "precise": _BOOL, "reached": _BOOL, "collided": _BOOL,
        "out_of_limits": _BOOL, "failure": _TEXT, "failure_detail": _TEXT,
        "steps": _INT, "final_distance": _REAL, "settled_distance": _REAL, "path_length": _REAL,
        "joint_movement": _REAL,
    },
    {"budget": _INT, "target_id": _INT, "distance_cm": _INT},
)  # fmt: skip

# One row a test of a pool and reference: Planner, Replay or StraightLine. What succeeds ends at the target and stays.
_REFERENCE_TRIALS = _schema(
    {
        "reference": _TEXT, "test_id": _INT, "kind": _TEXT, "x": _REAL, "y": _REAL, "z": _REAL, "hard": _BOOL,
        "success": _BOOL,
    },
    {"target_id": _INT, "distance_cm": _INT},
)  # fmt: skip

# One row a test that a network reached and that its study verifies: its rollout, timed, as a motion.
_MOTION_VERDICTS = _schema(
    {
        "evaluation_id": _TEXT, "kind": _TEXT, "test_id": _INT, "passed": _BOOL, "failed_check": _TEXT, "reason": _TEXT,
    },
    {"duration": _REAL},
)  # fmt: skip

# One row a pool of a study and time at which the study became the latest of its name.
_STUDIES = _schema(
    {
        "name": _TEXT, "study_key": _TEXT, "config": _TEXT, "robot": _TEXT, "scene": _TEXT, "pool": _TEXT,
        "pool_label": _TEXT, "planners": pa.list_(_TEXT), "labelling": _TEXT, "n_targets": _INT,
        "run_at": pa.timestamp("us", tz="UTC"), "package_version": _TEXT, "ompl_version": _TEXT,
    },
    {},
)  # fmt: skip

POOL_LEVELS = ("robot", "scene", "pool")

TABLES = {
    t.name: t
    for t in (
        Table("trajectories", (*POOL_LEVELS, "planner"), ("trajectory_id",), _TRAJECTORIES),
        Table("targets", POOL_LEVELS, ("target_id",), _TARGETS),
        Table("ways", (*POOL_LEVELS, "labelling"), ("trajectory_id",), _WAYS),
        Table("selections", (*POOL_LEVELS, "study"), ("selection_id", "trajectory_id"), _SELECTIONS),
        Table("rankings", POOL_LEVELS, ("selection_id",), _RANKINGS),
        Table("corrections", POOL_LEVELS, ("correction_id",), _CORRECTIONS),
        Table("evaluations", (*POOL_LEVELS, "study"), ("evaluation_id", "kind", "test_id"), _EVALUATIONS),
        Table(
            "reference_trials",
            (*POOL_LEVELS, "study"),
            ("reference", "kind", "test_id"),
            _REFERENCE_TRIALS,
        ),
        Table(
            "motion_verdicts",
            (*POOL_LEVELS, "study"),
            ("evaluation_id", "kind", "test_id"),
            _MOTION_VERDICTS,
        ),
        Table("studies", ("study",), ("pool", "run_at"), _STUDIES),
    )
}
