"""Queries of the report page on a lake whose numbers can be counted by hand."""

from __future__ import annotations

import math
from typing import Any

import pyarrow as pa
import pytest

from plancurate.tasks.lake.schema import table
from plancurate.tasks.lake.store import Lake

POOL = {"robot": "h2017", "scene": "free", "pool": "0a1b2c"}
STUDY = "tiny-abc"


def trials(
    selector: str, budget: int | None, policy: str, seed: int, outcomes: str, kind: str = "displaced"
) -> pa.Table:
    """One trial a letter: S settled, R reached only, . missed; the second half is 1 cm away."""
    rows = [
        {
            "evaluation_id": f"{selector}-{policy}-{seed}-{kind}", "selection_id": f"{selector}-{budget}",
            "selector": selector, "budget": budget, "policy": policy, "seed": seed, "n_kept": 4,
            "selection_time_s": 0.5, "train_s": 1.0, "test_id": i, "kind": kind,
            "target_id": 0 if kind == "displaced" else None,
            "distance_cm": 2 * i // len(outcomes) if kind == "displaced" else None,
            "x": 0.0, "y": 0.0, "z": 0.0, "success": outcome in "SR", "settled": outcome == "S",
            "reached": outcome != ".", "collided": False, "out_of_limits": False, "steps": 10,
            "final_distance": 0.01 * (i + 1), "settled_distance": 0.02 * (i + 1), "path_length": 1.0 + seed,
            "joint_movement": 2.0,
        }
        for i, outcome in enumerate(outcomes)
    ]  # fmt: skip
    return pa.Table.from_pylist(rows, table("evaluations").schema)


def kept(selection_id: str, budget: int | None, planners: list[str]) -> pa.Table:
    """A selection of one trajectory of each planner named."""
    times = ("prepare_s", "base_policy_s", "rollouts_s", "cluster_s", "score_s", "select_s")
    rows = [
        {
            "selection_id": selection_id, "seed": 0, "pool_hash": "", "n_targets": 3, "params": "{}",
            "trajectory_id": f"{planner}-{i}", "target_id": 0, "planner": planner, "goal_index": 0,
            "n_pool": 16, "budget": budget, **dict.fromkeys((*times, "selection_time_s"), 0.0),
        }
        for i, planner in enumerate(planners)
    ]  # fmt: skip
    return pa.Table.from_pylist(rows, table("selections").schema)


@pytest.fixture
def lake(small_lake: Lake) -> Lake:
    """One study: General with one network, DBSCAN with three; and another study that must not count."""
    tests = [
        trials("General", None, "BC_MLP", 0, "S"),
        trials("DBSCAN", 2, "BC_MLP", 0, "SR.."),
        trials("DBSCAN", 2, "BC_MLP", 1, "R..."),
        trials("DBSCAN", 2, "BC_RNN", 0, "SSSR"),
        trials("DBSCAN", 2, "BC_RNN", 0, "..", kind="unseen"),
    ]
    for number, rows in enumerate(tests):
        small_lake.write("evaluations", {**POOL, "study": STUDY}, f"e{number}", rows, {})
    other = trials("DBSCAN", 1, "BC_MLP", 0, "SSSS")
    small_lake.write("evaluations", {**POOL, "study": "other-abc"}, "e0", other, {})
    for selector, budget, planners in (
        ("General", None, ["PRM", "RRT", "RRT", "RRT"]),
        ("DBSCAN", 2, ["RRT", "PRM", "PRM"]),
        ("DBSCAN", 1, ["RRT"]),
    ):
        rows = kept(f"{selector}-{budget}", budget, planners)
        small_lake.write("selections", {**POOL, "selector": selector}, f"{selector}-{budget}", rows, {})
    return small_lake


def answer(lake: Lake, name: str, kind: str = "displaced") -> list[tuple[Any, ...]]:
    """Rows of a query as tuples."""
    rows = lake.query(f"results/{name}", study=STUDY, kind=kind).to_pylist()
    return [tuple(row.values()) for row in rows]


def test_success_by_policy_runs_over_seeds(lake: Lake) -> None:
    assert answer(lake, "by_policy_total") == [
        ("DBSCAN", 2, "BC_MLP", 8, 3, 1, 2),
        ("DBSCAN", 2, "BC_RNN", 4, 4, 3, 1),
        ("General", None, "BC_MLP", 1, 1, 1, 1),
    ]
    assert answer(lake, "by_policy_total", kind="unseen") == [("DBSCAN", 2, "BC_RNN", 2, 0, 0, 1)]


def test_success_by_distance_runs_over_policies_and_seeds(lake: Lake) -> None:
    assert answer(lake, "by_distance") == [
        ("DBSCAN", 2, 0, 6, 5, 3),
        ("DBSCAN", 2, 1, 6, 2, 1),
        ("General", None, 0, 1, 1, 1),
    ]


def test_fresh_targets_have_no_distance(lake: Lake) -> None:
    assert answer(lake, "by_distance", kind="unseen") == []


def test_quality_has_means_and_sample_deviations(lake: Lake) -> None:
    dbscan, general = lake.query("results/quality", study=STUDY, kind="displaced").to_pylist()
    assert (dbscan["selector"], dbscan["budget"], dbscan["n"]) == ("DBSCAN", 2, 12)
    # Three times 1, 2, 3, 4 cm: squares about 2.5 cm sum to 3 * 5, over n - 1 = 11.
    assert dbscan["final_distance"] == pytest.approx(0.025)
    assert dbscan["final_distance_std"] == pytest.approx(0.01 * math.sqrt(15 / 11))
    assert dbscan["settled_distance"] == pytest.approx(0.05)
    assert dbscan["settled_distance_std"] == pytest.approx(0.02 * math.sqrt(15 / 11))
    # Four rollouts of 2 m, eight of 1 m.
    assert dbscan["path_length"] == pytest.approx(4 / 3)
    assert dbscan["path_length_std"] == pytest.approx(math.sqrt((4 * (2 / 3) ** 2 + 8 * (1 / 3) ** 2) / 11))
    assert (dbscan["joint_movement"], dbscan["joint_movement_std"]) == (2.0, 0.0)
    assert (general["n"], general["path_length"], general["path_length_std"]) == (1, 1.0, None)


def test_planners_kept_are_those_of_the_studys_own_selections(lake: Lake) -> None:
    rows = lake.query("results/planners_kept", study=STUDY, kind="displaced").to_pylist()
    assert [(row["selector"], row["budget"], row["planner"], row["kept"]) for row in rows] == [
        ("DBSCAN", 2, "PRM", 2),
        ("DBSCAN", 2, "RRT", 1),
        ("General", None, "RRT", 3),
        ("General", None, "PRM", 1),
    ]
    assert [row["share"] for row in rows] == pytest.approx([2 / 3, 1 / 3, 3 / 4, 1 / 4])
