"""Made-up studies in a lake."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime

import pyarrow as pa
import pytest

from plancurate.tasks.lake.schema import table
from plancurate.tasks.lake.store import Lake

from .lakes import POOL, trajectory

LABELLING = "1abe1"
NO_SECONDS = dict.fromkeys(
    ("prepare_s", "base_policy_s", "rollouts_s", "cluster_s", "score_s", "select_s", "selection_time_s"), 0.0
)

FAILURES = {
    "S": ("", ""),
    "R": ("", ""),
    "C": ("collided", "link_4 and table"),
    "L": ("limits", "joint_2 velocity"),
    ".": ("lost", ""),
}


class StudyMaker:
    """Writes made-up studies into a lake: one row in `studies`, selections, trials."""

    def __init__(self, lake: Lake) -> None:
        self.lake = lake

    def record(
        self,
        name: str,
        key: str,
        pools: Sequence[tuple[dict[str, str], str]] = ((POOL, ""),),
        **changes: object,
    ) -> str:
        """Record a study that works on these pools (partition and label); returns its identifier."""
        study = f"{name}-{key}"
        rows = [
            {
                "name": name, "study_key": key, "config": "{}", **pool, "pool_label": label,
                "planners": ["RRT", "PRM"], "labelling": LABELLING, "n_targets": 3,
                "run_at": datetime(2026, 1, 1, tzinfo=UTC), "package_version": "0", "ompl_version": "1.5.2",
            } | changes
            for pool, label in pools
        ]  # fmt: skip
        part = pa.Table.from_pylist(rows, table("studies").schema)
        self.lake.write("studies", {"study": study}, f"{rows[0]['run_at']:%Y%m%d}", part, {})
        return study

    def plan(self, planner: str, target_id: int, key: str = "more", **changes: object) -> None:
        """Add a run of a planner to the pool, whichever study asked for it."""
        part = pa.Table.from_pylist(
            [trajectory(target_id, planner, 0) | changes], table("trajectories").schema
        )
        self.lake.write("trajectories", {**POOL, "planner": planner}, f"{target_id:06d}-{key}", part, {})

    def label(self, ways: Mapping[str, str | None], labelling: str = LABELLING) -> None:
        """Record the ways of trajectories, such as t0001-RRT-r0-0a1b2c."""
        rows = [
            {"trajectory_id": name, "target_id": int(name[1:5]), "way": way} for name, way in ways.items()
        ]
        part = pa.Table.from_pylist(rows, table("ways").schema)
        self.lake.write("ways", {**POOL, "labelling": labelling}, "000000-000002", part, {})

    def test(
        self,
        study: str,
        selector: str,
        budget: int | None,
        policy: str,
        outcomes: str,
        *,
        seed: int = 0,
        selection_seed: int = 0,
        round: int = 0,
        kind: str = "displaced",
        pool: Mapping[str, str] = POOL,
        xs: Sequence[float] = (),
        **changes: object,
    ) -> None:
        """Record a network's trials, one a letter and cm from its target, at these x in m or all in one place.

        S settled, R reached, C collided with the table, L broke joint 2's velocity limit, . lost.
        """
        selection_id = f"{selector}-{budget}-{selection_seed}"
        key = f"{selector}-{budget}-{policy}-{seed}-{selection_seed}-{round}-{kind}"
        rows = [
            {
                "evaluation_id": key, "selection_id": selection_id, "selector": selector, "budget": budget,
                "selection_seed": selection_seed, "policy": policy, "seed": seed, "round": round, "n_kept": 4,
                "selection_time_s": 0.5, "train_s": 1.5, "test_id": number, "kind": kind,
                "target_id": 0 if kind == "displaced" else None,
                "distance_cm": number if kind == "displaced" else None,
                "x": xs[number] if xs else 0.0, "y": 0.0, "z": 0.0,
                "hard": False, "success": outcome in "SR", "settled": outcome == "S", "precise": outcome == "S",
                "reached": outcome in "SR", "collided": outcome == "C", "out_of_limits": outcome == "L",
                "failure": FAILURES[outcome][0], "failure_detail": FAILURES[outcome][1], "steps": 10,
                "final_distance": 0.01 * number, "settled_distance": 0.02 * number, "path_length": 1.0,
                "joint_movement": 2.0 + number,
            } | changes
            for number, outcome in enumerate(outcomes)
        ]  # fmt: skip
        part = pa.Table.from_pylist(rows, table("evaluations").schema)
        self.lake.write("evaluations", {**pool, "study": study}, key, part, {})

    def judge(self, study: str, selector: str, budget: int | None, policy: str, verdicts: str) -> None:
        """Record what the verifier says of a network's displaced tests: P passes, F fails, . was not looked at."""
        key = f"{selector}-{budget}-{policy}-0-0-0-displaced"
        rows = [
            {
                "evaluation_id": key, "kind": "displaced", "test_id": number, "passed": verdict == "P",
                "failed_check": "" if verdict == "P" else "torque",
                "reason": "" if verdict == "P" else "joint_2 exceeds its torque limit", "duration": 1.5,
            }
            for number, verdict in enumerate(verdicts)
            if verdict != "."
        ]  # fmt: skip
        part = pa.Table.from_pylist(rows, table("motion_verdicts").schema)
        self.lake.write("motion_verdicts", {**POOL, "study": study}, key, part, {})

    def refer(
        self, study: str, *, kind: str = "displaced", pool: Mapping[str, str] = POOL, **outcomes: str
    ) -> None:
        """Record what references reach of tests, one a letter: S or s succeeded, h and s are hard."""
        rows = [
            {
                "reference": reference, "test_id": number, "kind": kind, "x": 0.0, "y": 0.0, "z": 0.0,
                "hard": outcome in "sh", "success": outcome in "Ss", "target_id": 0, "distance_cm": None,
            }
            for reference, letters in outcomes.items()
            for number, outcome in enumerate(letters)
        ]  # fmt: skip
        part = pa.Table.from_pylist(rows, table("reference_trials").schema)
        self.lake.write("reference_trials", {**pool, "study": study}, kind, part, {})

    def select(
        self,
        study: str,
        selector: str,
        budget: int | None,
        kept: Sequence[tuple[int, str, int]],
        *,
        seed: int = 0,
        pool: Mapping[str, str] = POOL,
        **changes: object,
    ) -> None:
        """Record a selection of the first runs of (target, planner), each with its goal configuration."""
        selection_id = f"{selector}-{budget}-{seed}"
        rows = [
            {
                "selection_id": selection_id, "selector": selector, "seed": seed, "pool_hash": "feed",
                "n_targets": 3, "params": "{}", "trajectory_id": f"t{target:04d}-{planner}-r0-{POOL['pool']}",
                "target_id": target, "planner": planner, "goal_index": goal, "n_pool": 16, "budget": budget,
                **NO_SECONDS,
            } | changes
            for target, planner, goal in kept
        ]  # fmt: skip
        part = pa.Table.from_pylist(rows, table("selections").schema)
        self.lake.write("selections", {**pool, "study": study}, selection_id, part, {})

    def rank(self, selector: str, budget: int | None, split_half: float, *, seed: int = 0) -> None:
        """Record how stably the scores of a selection of the pool rank."""
        selection_id = f"{selector}-{budget}-{seed}"
        row = {"selection_id": selection_id, "split_half": split_half}
        self.lake.write(
            "rankings", POOL, selection_id, pa.Table.from_pylist([row], table("rankings").schema), {}
        )


@pytest.fixture
def maker(small_lake: Lake) -> StudyMaker:
    """Writes studies into the small lake."""
    return StudyMaker(small_lake)
