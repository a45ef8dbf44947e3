"""What a study's key and its ids stand for."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import plancurate.robots
from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.tasks.candidates.sources import base as sources
from plancurate.tasks.curation.selectors import base as selectors
from plancurate.tasks.lake.home import Home
from plancurate.tasks.learning import corrections, rollouts, train, training_goals
from plancurate.tasks.learning.observations import term as terms
from plancurate.tasks.learning.policies import kind_of
from plancurate.tasks.study.config import load_config
from plancurate.tasks.study.context import StudyContext, open_study, reference
from plancurate.tasks.study.evaluations import evaluation_id
from plancurate.tasks.study.networks import Network, network_id
from plancurate.tasks.study.selections import WantedSelection

SHIPPED = Path(plancurate.robots.__file__).parent
Change = Callable[[pytest.MonkeyPatch], None]


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """A scene file of a user's own."""
    file = tmp_path / "mine.yaml"
    file.write_text("ground: 0.0\nmargin: 0.005\nshapes: []\n")
    return file


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    """A robot folder of a user's own."""
    return Path(shutil.copytree(SHIPPED / "h2017", tmp_path / "arm"))


def network_of_no_data(study: StudyContext) -> Network:
    selection = wanted(study)
    return Network("BC_MLP", selection, 0, network_id(study, selection, "BC_MLP", 0))


def wanted(study: StudyContext, selection_id: str = "selection") -> WantedSelection:
    return WantedSelection(study.pools[0].pool, "pool", study.config.selectors[0], 20, 0, selection_id)


def opened(scene: Path, robot: Path, **fields: Any) -> StudyContext:
    config = load_config("smoke", None, {"scenes": [str(scene)], "robot": str(robot), **fields})
    return open_study(config, Home(scene.parent / "home"))


OTHER_FIELDS: dict[str, Any] = {
    "n_targets": 3,
    "planners": ["RRTConnect"],
    "candidates": {"plan": {"seed": 1}},
    "selectors": ["General"],
    "budgets": [1],
    "selection_seeds": [1],
    "policies": ["BC_MLP"],
    "seeds": [1],
    "training": {"learning_rate": 0.002},
    "evaluation": {"max_steps": 100},
    "unseen": 1,
    "displaced_targets": 1,
}


@pytest.mark.parametrize("field", OTHER_FIELDS)
def test_a_field_that_decides_a_result_changes_the_key(scene: Path, robot: Path, field: str) -> None:
    assert opened(scene, robot, **{field: OTHER_FIELDS[field]}).key != opened(scene, robot).key


def test_how_many_tests_are_verified_is_in_the_key_of_a_study_that_verifies_some(
    scene: Path, robot: Path
) -> None:
    none, few, many = (opened(scene, robot, verified_tests=tests).key for tests in (0, 1, 2))
    assert none == opened(scene, robot).key
    assert len({none, few, many}) == 3


@pytest.mark.parametrize(
    "fields", [{"name": "other"}, {"workers": 1}, {"targets_per_task": 2}, {"runner": "processes"}]
)
def test_what_makes_a_study_fast_or_names_it_leaves_the_key(
    scene: Path, robot: Path, fields: dict[str, Any]
) -> None:
    assert opened(scene, robot, **fields).key == opened(scene, robot).key


def test_a_changed_choice_of_goals_is_another_evaluation_where_goals_are_shown_and_only_there(
    scene: Path, robot: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def names(terms: list[str]) -> tuple[str, str]:
        study = opened(scene, robot, training={"observation": terms})
        return study.key, evaluation_id(study, network_of_no_data(study))

    plain, goal = ["joint_positions"], ["joint_positions", "goal_offset"]
    before = names(plain), names(goal)
    monkeypatch.setattr(training_goals, "REVISION", training_goals.REVISION + 1)
    after = names(plain), names(goal)
    assert before[0] == after[0]
    assert {*before[1]}.isdisjoint(after[1])


def test_the_key_is_of_contents_not_of_paths(scene: Path, robot: Path, tmp_path: Path) -> None:
    moved = tmp_path / "elsewhere"
    moved.mkdir()
    same_scene, same_robot = shutil.copy(scene, moved), shutil.copytree(robot, moved / "arm")
    assert opened(Path(same_scene), Path(same_robot)).key == opened(scene, robot).key


def test_an_edited_scene_is_another_pool_and_another_study(scene: Path, robot: Path) -> None:
    before = opened(scene, robot)
    scene.write_text(scene.read_text().replace("0.005", "0.006"))
    after = opened(scene, robot)
    assert after.key != before.key
    assert after.pools[0].pool != before.pools[0].pool
    assert after.study_partition(after.pools[0]) != before.study_partition(before.pools[0])


def test_an_edited_robot_is_another_pool_and_another_study(scene: Path, robot: Path) -> None:
    before = opened(scene, robot)
    urdf = robot / "robot.urdf"
    urdf.write_text(urdf.read_text().replace("</robot>", "<!-- heavier --></robot>"))
    after = opened(scene, robot)
    assert (after.key, after.pools[0].pool) != (before.key, before.pools[0].pool)


def raise_training(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(train, "REVISION", train.REVISION + 1)


def raise_rollouts(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(rollouts, "REVISION", rollouts.REVISION + 1)


def raise_policy(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(kind_of("BC_MLP"), "revision", 99)


def raise_term(patch: pytest.MonkeyPatch) -> None:
    patch.setitem(
        terms._registry, "joint_positions", replace(terms.find_term("joint_positions"), revision=99)
    )


def raise_selector(patch: pytest.MonkeyPatch) -> None:
    chosen = selectors.find_selector("KMeans_Hybrid")
    patch.setitem(selectors._registry, "KMeans_Hybrid", replace(chosen, revision=99))


def raise_source(patch: pytest.MonkeyPatch) -> None:
    patch.setitem(sources._registry, "PRM", replace(sources.find_source("PRM"), revision=99))


def other_ompl(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(native, "ompl_version", lambda: "9.9.9")


@pytest.mark.parametrize(
    "change",
    [raise_training, raise_rollouts, raise_policy, raise_term, raise_selector, raise_source, other_ompl],
)
def test_a_raised_revision_changes_the_key(
    scene: Path, robot: Path, change: Change, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = opened(scene, robot).key
    change(monkeypatch)
    assert opened(scene, robot).key != before


def test_another_ompl_makes_another_pool(scene: Path, robot: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = opened(scene, robot).pools[0].pool
    other_ompl(monkeypatch)
    assert opened(scene, robot).pools[0].pool != before


@pytest.mark.parametrize("change", [raise_training, raise_policy, raise_term])
def test_a_network_is_named_by_what_it_is_trained_with(
    scene: Path, robot: Path, change: Change, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = opened(scene, robot)
    before = network_id(study, wanted(study), "BC_MLP", 0)
    other = opened(scene, robot, training={"clip": 0.5})
    assert network_id(other, wanted(other), "BC_MLP", 0) != before
    assert network_id(study, wanted(study, "other"), "BC_MLP", 0) != before
    change(monkeypatch)
    assert network_id(study, wanted(study), "BC_MLP", 0) != before


ROUNDS: dict[str, Any] = {"training": {"demonstration_steps": "arc"}, "corrections": {"rounds": 2}}


def test_a_corrected_network_is_named_by_its_round_and_by_how_it_is_corrected(
    scene: Path, robot: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def names(study: StudyContext) -> list[str]:
        return [network_id(study, wanted(study), "BC_MLP", 0, round) for round in range(3)]

    study = opened(scene, robot, **ROUNDS)
    before = names(study)
    assert len(set(before)) == 3
    more = opened(scene, robot, **ROUNDS | {"corrections": {"rounds": 3}})
    assert (names(more), more.key != study.key) == (before, True)
    for other in ({"corrections": {"rounds": 2, "most_share": 0.3}}, {"evaluation": {"max_steps": 50}}):
        changed = names(opened(scene, robot, **ROUNDS | other))
        assert [one == old for one, old in zip(changed, before, strict=True)] == [True, False, False]
    key = study.key
    monkeypatch.setattr(corrections, "REVISION", corrections.REVISION + 1)
    assert [one == old for one, old in zip(names(study), before, strict=True)] == [True, False, False]
    assert opened(scene, robot, **ROUNDS).key != key


def test_how_to_correct_is_nothing_to_a_study_without_rounds(
    scene: Path, robot: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = opened(scene, robot).key
    assert opened(scene, robot, corrections={"most_share": 0.3}).key == before
    monkeypatch.setattr(corrections, "REVISION", corrections.REVISION + 1)
    assert opened(scene, robot).key == before


def test_corrections_need_arc_steps(scene: Path, robot: Path) -> None:
    with pytest.raises(PlancurateError, match=r"corrections.rounds = 1: .*steps is 'time', it must be 'arc'"):
        opened(scene, robot, corrections={"rounds": 1})


def test_a_task_refuses_a_study_whose_scene_was_edited_under_way(scene: Path, robot: Path) -> None:
    ref = reference(opened(scene, robot))
    scene.write_text(scene.read_text().replace("0.005", "0.006"))
    with pytest.raises(PlancurateError, match=r"a file of robot .* or of scenes .*mine.yaml changed while"):
        ref.open()


def test_variants_of_a_pool_are_pools_of_their_own_in_every_scene(scene: Path, robot: Path) -> None:
    variants = {"all": {}, "one": {"plan": {"goals": "nearest"}}}
    study = opened(scene, robot, scenes=[str(scene), "table"], pools=variants)
    assert [pool.title for pool in study.pools] == ["mine all", "mine one", "table all", "table one"]
    assert len({pool.pool for pool in study.pools}) == 4
    assert opened(scene, robot, pools={"all": {}}).pools[0].pool == opened(scene, robot).pools[0].pool


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"pools": {"a": {}, "b": {}}}, "'mine a' and 'mine b' are made alike"),
        ({"pools": {"a": {"plan": {"runs": 0}}}}, r"pools.a.plan.runs = 0"),
        ({"selectors": ["KMeans", "KMeans"]}, "names a selector twice"),
        ({"selectors": [{"name": "KMeans", "n": 1}]}, "parameter"),
    ],
)
def test_what_does_not_make_a_study_is_one_line(
    scene: Path, robot: Path, fields: dict[str, Any], message: str
) -> None:
    with pytest.raises(PlancurateError, match=message) as caught:
        opened(scene, robot, **fields)
    assert "\n" not in str(caught.value)
