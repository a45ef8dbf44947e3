"""Scenes that vary: every target is planned to, trained on and tested in a scene of its own."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.robots import load_robot, load_scene
from plancurate.robots.clutter import FIRST_UNSEEN, parse_family
from plancurate.robots.scene_family import is_family, load_family
from plancurate.tasks.lake.home import Home
from plancurate.tasks.learning.demonstrations import demonstrations
from plancurate.tasks.learning.policies import TrainedPolicy
from plancurate.tasks.learning.rollouts import roll_out
from plancurate.tasks.study import candidates
from plancurate.tasks.study import demonstrations as demonstrations_of
from plancurate.tasks.study.candidates import make_part, missing_parts, reference_targets, study_targets
from plancurate.tasks.study.config import load_config
from plancurate.tasks.study.context import PoolContext, StudyContext, open_study
from plancurate.tasks.study.corrections import make_corrections
from plancurate.tasks.study.demonstrations import selected_demonstrations, selected_waypoints
from plancurate.tasks.study.evaluations import evaluate_networks, network_goals, rolled_out, study_tests
from plancurate.tasks.study.networks import load_network, train_networks, wanted_networks
from plancurate.tasks.study.records import record_study
from plancurate.tasks.study.references import best_of_targets, free_there, make_references, nearest_of
from plancurate.tasks.study.results import study_results
from plancurate.tasks.study.scenes import in_their_order, rows_by_scene
from plancurate.tasks.study.selections import make_selection, study_selections
from plancurate.tasks.study.ways import label_ways, unlabelled

FAMILY = "clutter:3..5:20"
FIELDS: dict[str, Any] = {
    "scenes": [FAMILY],
    "n_targets": 5,
    "planners": ["RRTConnect"],
    "candidates": {
        "targets": {"orientation": "cone"},
        "plan": {"goals": "consistent", "clearance_m": 0.025, "runs": 2},
    },
    "selectors": ["General", "CUPID"],
    "policies": ["BC_MLP"],
    "training": {"steps": 3, "demonstration_steps": "arc"},
    "varying_observation": ["goal_offset", "clearances_around"],
    "corrections": {"rounds": 1},
    "evaluation": {"max_steps": 4},
    "unseen": 6,
    "displaced_targets": 4,
}


def opened(home: Path, **fields: Any) -> StudyContext:
    return open_study(load_config("smoke", None, FIELDS | fields), Home(home))


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Iterator[StudyContext]:
    """Five targets in three scenes of clutter, planned, selected from and trained on."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(candidates, "REFERENCE_TARGETS", 8)  # few, for each takes a while
        yield trained_study(tmp_path_factory.mktemp("home"))


def trained_study(home: Path) -> StudyContext:
    study = opened(home)
    (pool,) = study.pools
    for part in missing_parts(study, pool, study_targets(study, pool)):
        make_part(study, part)
    for block in unlabelled(study):
        label_ways(study, block)
    record_study(study)
    train_networks(study, [first_network(study)])
    return study


@pytest.fixture(scope="module")
def pool(study: StudyContext) -> PoolContext:
    return study.pools[0]


def first_network(study: StudyContext) -> Any:
    return wanted_networks(study, study_selections(study))[0]


def trained_on(study: StudyContext) -> TrainedPolicy:
    return load_network(study, first_network(study))


def test_rows_are_found_again_whatever_scene_they_lie_in() -> None:
    one, other = load_scene("free"), load_scene("table")
    groups = [(scene, rows.tolist()) for scene, rows in rows_by_scene([one, other, one, one, other])]
    assert groups == [(one, [0, 2, 3]), (other, [1, 4])]
    done = np.concatenate([[f"row {i}" for i in rows] for _, rows in groups])
    assert done[in_their_order([np.array(rows) for _, rows in groups])].tolist() == [
        f"row {i}" for i in range(5)
    ]


@pytest.mark.parametrize("name", ["clutter:5..3", "clutter:1..900000000", "clutter:1..", "clutter:1..3:0"])
def test_what_is_no_family_is_refused(name: str) -> None:
    assert is_family(name)
    with pytest.raises(PlancurateError, match=r"scene clutter:\d"):
        parse_family(name)


def test_targets_go_round_the_scenes_and_no_test_lies_in_one_of_them() -> None:
    robot = load_robot("h2017")
    family = load_family(FAMILY, robot)
    assert [family.training(target) for target in range(4)] == [
        f"clutter:{seed}:20:0.06" for seed in (3, 4, 5, 3)
    ]
    assert family.unseen(7) == f"clutter:{FIRST_UNSEEN + 7}:20:0.06"
    assert family.member(family.training(1)).digest == load_scene("clutter:4:20", robot).digest
    assert not family.shared.shapes
    assert (
        family.shared.regions == pytest.approx(load_scene("clutter:4:20", robot).regions)
        or family.shared.regions
    )


@pytest.mark.slow
def test_each_candidate_is_free_in_the_scene_of_its_target(study: StudyContext, pool: PoolContext) -> None:
    rows = study.lake.read("trajectories", pool.partition).to_pylist()
    verified = [row for row in rows if row["verified"]]
    assert len({row["target_id"] for row in verified}) >= 4
    assert all(row["trajectory_id"].endswith(pool.pool) for row in rows)
    for row in verified:
        q, (scene,) = np.array(row["q"]), pool.scenes_of_targets([row["target_id"]])
        assert native.edge_is_free(pool.robot.native, scene.native, q[:-1], q[1:], 0.02).all()
    elsewhere = load_scene(f"clutter:{FIRST_UNSEEN}:60", pool.robot)
    paths = [np.array(row["q"]) for row in verified]
    assert not all(
        native.edge_is_free(pool.robot.native, elsewhere.native, q[:-1], q[1:], 0.02).all() for q in paths
    )


@pytest.mark.slow
def test_goals_continue_a_references_whatever_other_targets_there_are(
    study: StudyContext, pool: PoolContext
) -> None:
    assert {target.target_id for target in reference_targets(pool)} == {-1}
    fewer = opened(study.home.root.parent / "fewer", n_targets=2)
    drawn = study_targets(fewer, fewer.pools[0])
    for one, other in zip(drawn, study_targets(study, pool), strict=False):
        np.testing.assert_array_equal(one.goals, other.goals)


def test_demonstrations_observe_the_scene_that_they_lie_in(study: StudyContext, pool: PoolContext) -> None:
    wanted = first_network(study).selection
    data, selection = selected_demonstrations(study, wanted), make_selection(study, wanted)
    paths = selected_waypoints(study, selection, pool.partition)
    targets = selection.kept["target_id"].to_pylist()
    assert dict(data.layout).keys() == {"goal_offset", "clearances_around"}
    own = [i for i, target in enumerate(targets) if target % 3 == targets[0] % 3]
    (scene,) = pool.scenes_of_targets(targets[:1])
    alone = demonstrations(
        pool.robot, scene, [paths[i] for i in own], np.zeros((len(own), 3)), pool.training(study.config)
    )
    np.testing.assert_array_equal(data.observations[: len(alone.observations)], alone.observations)
    assert len(data.starts) == len(targets)


def test_what_is_seen_along_a_trajectory_is_observed_once(
    study: StudyContext, pool: PoolContext, monkeypatch: pytest.MonkeyPatch
) -> None:
    wanted = first_network(study).selection
    observed, again = [], demonstrations_of.seen_along
    monkeypatch.setattr(
        demonstrations_of, "seen_along", lambda *given: (observed.append(len(given[2])), again(*given))[1]
    )
    demonstrations_of._observed.cache_clear()
    first, second = selected_demonstrations(study, wanted), selected_demonstrations(study, wanted)
    assert sum(observed) == len(first.starts)
    np.testing.assert_array_equal(first.observations, second.observations)


@pytest.mark.slow
def test_tests_are_rolled_out_each_in_its_own_scene(study: StudyContext, pool: PoolContext) -> None:
    tests, policy = study_tests(study, pool), trained_on(study)
    assert tests.kind.count("unseen_scene") == 6
    assert set(tests.kind) == {"displaced", "unseen_scene"}
    (together,), goals = rolled_out(study, pool, [policy], tests), network_goals(study, pool, [policy], tests)
    assert goals is not None
    scenes = pool.scenes_of_tests(tests.kind, tests.target_id.tolist())
    assert tests.planned is not None
    for goal, scene, planned in zip(goals[0], scenes, tests.planned, strict=True):
        assert native.is_free(pool.robot.native, scene.native, goal[None])[0] or not planned
    assert together["test_id"].to_pylist() == tests.test_id.tolist()
    for i in range(0, len(tests), 9):
        (alone,) = roll_out(
            [policy],
            pool.robot,
            scenes[i],
            tests.take([i]),
            study.config.evaluation,
            pool.settings.timing.dt,
            goals[:, [i]],
        )
        (row,), (expected,) = together.slice(i, 1).to_pylist(), alone.to_pylist()
        assert row["test_id"] == i
        assert row["final_distance"] == pytest.approx(expected["final_distance"], abs=1e-7)
        assert row["joint_movement"] == pytest.approx(expected["joint_movement"], abs=1e-6)


def test_a_replayed_trajectory_must_be_free_where_it_is_replayed(
    study: StudyContext, pool: PoolContext
) -> None:
    best, tests = best_of_targets(study, pool), study_tests(study, pool)
    free = np.asarray(free_there(study, pool, best, tests))
    ids = best["trajectory_id"].take(nearest_of(best, tests.position)).to_pylist()
    rows = study.lake.read("trajectories", pool.partition).to_pylist()
    path = {row["trajectory_id"]: np.array(row["q"]) for row in rows}
    scenes = pool.scenes_of_tests(tests.kind, tests.target_id.tolist())
    for name, scene, said in zip(ids, scenes, free, strict=True):
        assert native.is_free(pool.robot.native, scene.native, path[name]).all() or not said
    assert free.any()
    assert not free.all()


@pytest.mark.slow
def test_results_have_rows_of_scenes_that_nobody_trained_in(study: StudyContext, pool: PoolContext) -> None:
    network = first_network(study)
    evaluate_networks(study, [network])
    make_references(study, pool)
    corrected = wanted_networks(study, study_selections(study))[1]
    assert make_corrections(study, corrected) > 0
    targets = study.lake.read("corrections", pool.partition).to_pylist()
    for row in targets:
        q, (scene,) = np.array(row["q"]), pool.scenes_of_targets([row["target_id"]])
        assert native.edge_is_free(pool.robot.native, scene.native, q[:-1], q[1:], 0.02).all()
    (row,) = study_results(study.lake, study.study).on("unseen_scene").networks
    assert (row.n, row.kind, row.scene) == (6, "unseen_scene", "clutter-3-to-5-20-0.06")


def test_selectors_that_roll_out_are_left_out_where_scenes_vary(study: StudyContext) -> None:
    assert [wanted.choice.name for wanted in study_selections(study)] == ["General"]


def test_what_is_done_in_one_scene_is_refused(pool: PoolContext) -> None:
    with pytest.raises(
        PlancurateError, match=r"predict: the scenes clutter:3..5:20 vary, .* such as clutter:3:20"
    ):
        pool.require_one_scene("predict")


@pytest.mark.slow
def test_what_is_observed_there_names_only_studies_whose_scenes_vary(tmp_path: Path) -> None:
    terms = {"varying_observation": ["goal_offset", "nearest_obstacle"]}
    assert opened(tmp_path).key != opened(tmp_path, **terms).key
    assert opened(tmp_path, scenes=["table"]).key == opened(tmp_path, scenes=["table"], **terms).key
    assert opened(tmp_path).key != opened(tmp_path, scenes=["clutter:3..6:20"]).key
