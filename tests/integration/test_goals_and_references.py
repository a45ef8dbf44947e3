"""Networks that observe goals, and references, on a real pool: what is recorded, computed by other means."""

from __future__ import annotations

import shutil

import numpy as np
import pandas as pd
import pytest

from plancurate import native
from plancurate.tasks.lake.home import Home
from plancurate.tasks.study import evaluations
from plancurate.tasks.study.config import load_config
from plancurate.tasks.study.context import PoolContext, StudyContext, open_study
from plancurate.tasks.study.demonstrations import selected_demonstrations
from plancurate.tasks.study.evaluations import (
    evaluate_networks,
    evaluation_id,
    network_goals,
    study_tests,
)
from plancurate.tasks.study.motion_verdicts import missing_verdicts, verify_rollouts
from plancurate.tasks.study.networks import (
    load_network,
    train_networks,
    wanted_networks,
)
from plancurate.tasks.study.records import record_study
from plancurate.tasks.study.references import make_references, missing_references
from plancurate.tasks.study.results import study_results
from plancurate.tasks.study.selections import study_selections

from .conftest import Studied

FIELDS = {
    "selectors": ["General", "KMeans_Hybrid"],
    "policies": ["BC_MLP"],
    "unseen": 4,
    "verified_tests": 6,
}
GOAL = {"training": {"observation": ["target_offset", "joint_positions", "goal_offset"]}}
COPIES = ["target_id", "goal_index", "joint_movement", "smoothness", "path_length", "duration", "n_waypoints"]


@pytest.fixture(scope="module")
def study(smoke: Studied, tmp_path_factory: pytest.TempPathFactory) -> StudyContext:
    """The smoke study's pool under a study whose networks observe goals."""
    home = tmp_path_factory.mktemp("goals")
    shutil.copytree(smoke.untouched / "lake", home / "lake")
    return open_study(load_config("smoke", None, FIELDS | GOAL), Home.resolve(home))


@pytest.fixture(scope="module")
def pool(study: StudyContext) -> PoolContext:
    return study.pools[0]


def test_networks_that_observe_goals_are_trained_and_tested_with_goals_of_their_own(
    study: StudyContext, pool: PoolContext, monkeypatch: pytest.MonkeyPatch
) -> None:
    networks = wanted_networks(study, study_selections(study))
    train_networks(study, networks)
    trained, tests = [load_network(study, network) for network in networks], study_tests(study, pool)
    goals = network_goals(study, pool, trained, tests)
    assert goals is not None
    assert goals.shape == (2, len(tests), 6)
    with monkeypatch.context() as searched_once:  # networks of the same selections are shown the same
        searched_once.delattr(evaluations, "chosen_goals")
        again = [load_network(study, network) for network in networks]
        np.testing.assert_array_equal(network_goals(study, pool, again, tests), goals)
    assert native.is_free(pool.robot.native, pool.scene.native, goals.reshape(-1, 6)).all()
    tools = native.fk(pool.robot.native, goals.reshape(-1, 6))[:, :3, 3]
    np.testing.assert_allclose(tools, np.tile(tests.position, (2, 1)), atol=1e-5)
    hybrid = selected_demonstrations(study, networks[1].selection)
    ends = hybrid.q[hybrid.starts + hybrid.lengths - 1]
    # The first test is at the first target: the end kept for it, of two the first, is continued over no distance.
    np.testing.assert_allclose(goals[1, 0], ends[0], atol=0.05)
    assert evaluate_networks(study, networks) == 2 * len(tests)
    assert missing_verdicts(study) == networks
    assert verify_rollouts(study, networks) == 2
    assert missing_verdicts(study) == []
    looked_at = study.lake.sql(
        "SELECT success AND (kind = 'unseen' OR test_id < 2) AS expected, passed IS NOT NULL AS verified "
        "FROM evaluations LEFT JOIN motion_verdicts USING (study, evaluation_id, kind, test_id) "
        f"WHERE study = '{study.study}'"
    )
    assert looked_at["expected"].to_pylist() == looked_at["verified"].to_pylist()
    assert any(looked_at["verified"].to_pylist())
    plain = open_study(load_config("smoke", None, FIELDS), study.home)
    ids = {evaluation_id(plain, one) for one in wanted_networks(plain, study_selections(plain))}
    assert ids.isdisjoint(study.lake.keys("evaluations", study.study_partition(pool)))


def test_references_are_what_other_means_give(study: StudyContext, pool: PoolContext) -> None:
    tests = study_tests(study, pool)
    assert missing_references(study) == [pool]
    assert make_references(study, pool) == len(tests)
    assert missing_references(study) == []
    rows = study.lake.read("reference_trials", study.study_partition(pool)).to_pandas()
    planner, replay, line = (one.sort_values("test_id") for _, one in rows.groupby("reference", sort=True))
    assert planner[planner.kind == "displaced"].success.all()
    assert (line.success == ~line.hard).all()
    pool_rows = study.lake.sql("SELECT * EXCLUDE (q) FROM trajectories WHERE solved AND verified").to_pandas()
    candidates = pool_rows.drop_duplicates(COPIES)
    metrics = candidates[["joint_movement", "smoothness", "path_length"]]
    score = ((metrics - metrics.mean()) / metrics.std(ddof=0)).sum(axis=1)
    best = candidates.loc[score.groupby(candidates.target_id).idxmin()]
    expected = [replayed_by_hand(best, test) for test in tests.position]
    assert replay.success.tolist() == expected
    assert set(expected) == {True, False}


def replayed_by_hand(best: pd.DataFrame, position: np.ndarray) -> bool:
    """Whether the trajectory to the nearest target ends within 5 cm."""
    places = best[["target_x", "target_y", "target_z"]].to_numpy()
    ends = best[["tool_x", "tool_y", "tool_z"]].to_numpy()
    nearest = min(range(len(best)), key=lambda row: float(np.linalg.norm(places[row] - position)))
    return bool(np.linalg.norm(ends[nearest] - position) < 0.05)


def test_results_hold_the_references_of_both_kinds(study: StudyContext, pool: PoolContext) -> None:
    record_study(study)
    results = study_results(study.lake, study.study)
    for kind, n in (("unseen", 4), ("displaced", 32)):
        rows = results.on(kind).references  # type: ignore[arg-type]
        assert [(row.reference, row.n) for row in rows] == [
            ("Planner", n),
            ("Replay", n),
            ("StraightLine", n),
        ]


def test_a_study_shows_its_references(smoke: Studied) -> None:
    for reference in ("Planner", "Replay", "StraightLine"):
        assert f"\n{reference}" in smoke.stdout
    assert "A planner reaches 100.0 % of these 32 targets" in " ".join(smoke.stdout.split())
