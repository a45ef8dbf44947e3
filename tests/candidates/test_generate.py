from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pyarrow as pa
import pytest

from plancurate import native
from plancurate.robots import load_robot, load_scene
from plancurate.tasks.candidates import generate
from plancurate.tasks.candidates.generate import generate_candidates, pool_id
from plancurate.tasks.candidates.metrics import joint_movement
from plancurate.tasks.candidates.settings import GenerateSettings, PlanSettings, TargetSettings
from plancurate.tasks.candidates.targets import sample_targets
from plancurate.tasks.lake.schema import table

ROBOT = load_robot("h2017")
SCENE = load_scene("table")
SETTINGS = GenerateSettings(plan=PlanSettings(runs=2))
TARGETS = sample_targets(ROBOT, SCENE, SETTINGS.targets, 0, 3)
MEASURED = ["plan_s", "timing_s", "verify_s"]
PLANNERS = ["RRTConnect", "KPIECE1", "SBL", "EST"]


def rows(planner: str, settings: GenerateSettings = SETTINGS) -> pa.Table:
    return generate_candidates(ROBOT, SCENE, TARGETS, planner, settings)[0]


def test_every_run_is_a_row_of_the_lake():
    candidates, seconds = generate_candidates(ROBOT, SCENE, TARGETS, "EST", SETTINGS)
    assert candidates.schema == table("trajectories").schema
    pool = pool_id(ROBOT, SCENE, SETTINGS)
    names = [f"t{target:04d}-EST-r{run}-{pool}" for target in range(3) for run in range(2)]
    assert candidates["trajectory_id"].to_pylist() == names
    for stage in ("plan", "timing", "verify"):
        assert getattr(seconds, stage) == pytest.approx(sum(candidates[f"{stage}_s"].to_pylist()))


@pytest.mark.slow
def test_solved_rows_hold_a_free_trajectory_from_home_to_their_target(judge):
    candidates = [row for planner in PLANNERS for row in rows(planner).to_pylist() if row["solved"]]
    assert len(candidates) >= 20
    for row in candidates:
        q = np.array(row["q"], dtype=np.float32).astype(float)
        np.testing.assert_allclose(q[[0, -1]], [ROBOT.home, row["goal"]], atol=1e-6)
        assert native.edge_is_free(ROBOT.native, SCENE.native, q[:-1], q[1:], 0.01).all()
        assert row["n_waypoints"] == len(q)
        assert row["joint_movement"] == pytest.approx(joint_movement(q))
        assert row["duration"] == pytest.approx((len(q) - 1) * row["dt"])
        assert row["final_distance"] < 1e-5
        assert row["reason"] == ""


def test_pybullet_finds_every_stored_edge_free(judge):
    referee = judge(ROBOT, SCENE)
    for row in rows("KPIECE1").to_pylist():
        assert referee.penetration_on_edges(np.array(row["q"])).max() <= 0


def test_failed_runs_are_rows_with_a_reason():
    candidates = rows("RRT", SETTINGS.model_copy(update={"plan": PlanSettings(runs=2, state_checks=1)}))
    assert candidates.num_rows == 6
    for row in candidates.to_pylist():
        assert not row["solved"]
        assert not row["verified"]
        assert row["reason"]
        assert row["q"] == []
        assert row["goal_index"] == -1
        assert row["joint_movement"] is None


@pytest.mark.slow
def test_threads_do_not_change_what_is_written():
    alone = [rows(planner).drop_columns(MEASURED) for planner in PLANNERS]
    with ThreadPoolExecutor(4) as pool:
        together = [part.drop_columns(MEASURED) for part in pool.map(rows, PLANNERS)]
    assert all(a.equals(b) for a, b in zip(alone, together, strict=True))


def test_the_pool_is_named_by_what_decides_its_rows():
    others = [
        pool_id(ROBOT, load_scene("free"), SETTINGS),
        pool_id(ROBOT, SCENE, GenerateSettings()),
        pool_id(ROBOT, SCENE, SETTINGS.model_copy(update={"targets": TargetSettings(seed=1)})),
    ]
    assert len({pool_id(ROBOT, SCENE, SETTINGS), *others}) == 4
    params = [{"RRT": {"range": "1"}, "EST": {}}, {"EST": {}, "RRT": {"range": "1"}}]
    settings = [GenerateSettings(plan=PlanSettings(params=order)) for order in params]
    assert pool_id(ROBOT, SCENE, settings[0]) == pool_id(ROBOT, SCENE, settings[1])


def test_another_revision_or_version_of_ompl_is_another_pool(monkeypatch):
    ids = {pool_id(ROBOT, SCENE, SETTINGS)}
    with monkeypatch.context() as changed:
        changed.setattr(generate, "REVISION", generate.REVISION + 1)
        ids.add(pool_id(ROBOT, SCENE, SETTINGS))
    monkeypatch.setattr(native, "ompl_version", lambda: "9.9.9")
    ids.add(pool_id(ROBOT, SCENE, SETTINGS))
    assert len(ids) == 3
