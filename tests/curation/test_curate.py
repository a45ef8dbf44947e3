from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.robots import load_robot, load_scene
from plancurate.tasks.candidates.time_parameterisation import TimingSettings
from plancurate.tasks.curation import curate as steps
from plancurate.tasks.curation.learning_settings import LearningSettings
from plancurate.tasks.curation.pool import Pool, load_pool
from plancurate.tasks.curation.selector_choice import SelectorChoice
from plancurate.tasks.curation.selectors import base as registry
from plancurate.tasks.curation.selectors.base import Kept, Problem, Settings, selector, selector_names
from plancurate.tasks.curation.selectors.selection import Selection
from plancurate.tasks.lake.mend import mend
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.learning.settings import EvaluateSettings, TrainSettings

ROBOT, SCENE, STUDY = load_robot("h2017"), load_scene("free"), "one-12345678"
LEARNING = LearningSettings(TrainSettings(), EvaluateSettings(), TimingSettings())
PARTITION = {"robot": "h2017", "scene": "free", "pool": "0a1b2c"}
BUILT_IN = (
    "General", "Random", "RuleBased_General", "KMeans", "DBSCAN", "Hierarchical",
    "KMeans_Hybrid", "DBSCAN_Hybrid", "Hierarchical_Hybrid",
)  # fmt: skip


@pytest.fixture(autouse=True)
def selectors_of_this_test_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a test registers is forgotten with it; later tests ask for all that are registered."""
    selector_names()
    monkeypatch.setattr(registry, "_registry", dict(registry._registry))


def curate(
    lake: Lake,
    pool: Pool,
    name: str,
    budget: int | None,
    seed: int,
    params: dict[str, object] | None = None,
    *,
    study: str = STUDY,
    clock: Callable[[], float] = time.perf_counter,
) -> Selection:
    choice = SelectorChoice(name=name, **(params or {}))
    return steps.curate(
        lake,
        pool,
        study,
        choice,
        budget,
        seed,
        robot=ROBOT,
        scene=SCENE,
        learning=LEARNING,
        metadata={},
        clock=clock,
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", BUILT_IN)
def test_a_selection_is_recorded_and_making_it_again_changes_nothing(small_lake: Lake, name: str) -> None:
    pool = load_pool(small_lake, PARTITION)
    first = curate(small_lake, pool, name, 2, 5)
    parts = {path: path.stat().st_mtime_ns for path in small_lake.root.rglob("part-*.parquet")}
    again = curate(small_lake, pool, name, 2, 5)
    assert {path: path.stat().st_mtime_ns for path in small_lake.root.rglob("part-*.parquet")} == parts
    assert again.kept.to_pydict() == first.kept.to_pydict()
    for field in ("selection_id", "budget", "seed", "params", "pool_hash", "seconds", "selection_time_s"):
        assert getattr(again, field) == getattr(first, field)
    rows = small_lake.read("selections", {**PARTITION, "study": STUDY})
    assert set(rows["trajectory_id"].to_pylist()) == set(first.ids)
    assert rows["n_pool"].to_pylist()[0] == pool.candidates.num_rows
    assert json.loads(rows["params"][0].as_py()) == first.params


def test_what_another_study_selected_in_the_same_way_is_taken_over(small_lake: Lake) -> None:
    pool = load_pool(small_lake, PARTITION)
    first = curate(small_lake, pool, "KMeans_Hybrid", 2, 5)
    ticks = iter(range(1000, 2000))
    other = curate(small_lake, pool, "KMeans_Hybrid", 2, 5, study="two-1", clock=lambda: next(ticks) ** 2.0)
    assert other.selection_time_s == first.selection_time_s
    rows = {study: small_lake.read("selections", {**PARTITION, "study": study}) for study in (STUDY, "two-1")}
    assert rows[STUDY].drop_columns("study").equals(rows["two-1"].drop_columns("study"))


def test_an_edited_selector_does_not_return_the_old_selection(
    small_lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    pool = load_pool(small_lake, PARTITION)
    first = curate(small_lake, pool, "KMeans", 2, 0)
    chosen = registry.find_selector("KMeans")
    monkeypatch.setitem(registry._registry, "KMeans", replace(chosen, revision=chosen.revision + 1))
    assert curate(small_lake, pool, "KMeans", 2, 0).selection_id != first.selection_id


def test_parameters_that_were_given_are_part_of_the_name_in_tables(small_lake: Lake) -> None:
    selection = curate(
        small_lake, load_pool(small_lake, PARTITION), "KMeans_Hybrid", 1, 0, {"scaling": "raw"}
    )
    assert selection.selector == "KMeans_Hybrid(scaling=raw)"


def test_stages_add_up_to_at_most_the_selection_time(small_lake: Lake) -> None:
    ticks = iter(range(100))
    pool = load_pool(small_lake, PARTITION)
    selection = curate(small_lake, pool, "KMeans_Hybrid", 1, 0, clock=lambda: float(next(ticks)))
    spent = {stage: seconds for stage, seconds in selection.seconds.items() if seconds}
    assert spent == {"prepare": 1.0, "cluster": 1.0, "score": 2.0, "select": 2.0}
    assert selection.selection_time_s == 13.0


def test_other_settings_make_another_selection(small_lake: Lake) -> None:
    pool = load_pool(small_lake, PARTITION)
    asked = [
        ("KMeans_Hybrid", 2, 0, {}),
        ("KMeans_Hybrid", 1, 0, {}),
        ("KMeans_Hybrid", 2, 1, {}),
        ("KMeans_Hybrid", 2, 0, {"scaling": "raw"}),
    ]
    ids = {curate(small_lake, pool, *request).selection_id for request in asked}
    assert len(ids) == 4
    spelt_out = curate(small_lake, pool, "KMeans_Hybrid", 2, 0, {"scaling": "zscore"})
    assert spelt_out.selection_id in ids


def test_general_keeps_all_whatever_the_budget(small_lake: Lake) -> None:
    pool = load_pool(small_lake, PARTITION)
    first = curate(small_lake, pool, "General", None, 0)
    assert first.budget is None
    assert first.ids == sorted(pool.candidates["trajectory_id"].to_pylist())
    assert curate(small_lake, pool, "General", 7, 0).selection_id == first.selection_id


@pytest.mark.parametrize(
    ("name", "budget", "params", "message"),
    [
        ("KMeans", 0, {}, "budget is 0, it must be at least 1"),
        ("KMeans", None, {}, "budget is None"),
        (
            "KMeans_Hybrid",
            1,
            {"scaling": "max"},
            "parameter scaling = 'max': Input should be 'zscore'",
        ),
        ("KMeans", 1, {"scaling": "raw"}, "parameter scaling: unknown field 'scaling': .*n_init"),
        ("DBSCAN", 1, {"min_samples": 7}, "every candidate is noise"),
    ],
)
def test_requests_that_cannot_be_met_are_one_line_errors(
    small_lake: Lake, name: str, budget: int | None, params: dict[str, object], message: str
) -> None:
    pool = load_pool(small_lake, PARTITION)
    with pytest.raises(PlancurateError, match=message) as caught:
        curate(small_lake, pool, name, budget, 0, params)
    assert "\n" not in str(caught.value)
    assert not small_lake.keys("selections", {**PARTITION, "study": STUDY})


@pytest.mark.parametrize(("name", "kept"), [("Random", [5, 4, 5]), ("KMeans", [5, 4, 5])])
def test_a_target_with_fewer_candidates_than_the_budget_keeps_all_it_has(
    small_lake: Lake, name: str, kept: list[int]
) -> None:
    selection = curate(small_lake, load_pool(small_lake, PARTITION), name, 5, 0)
    assert np.bincount(selection.kept["target_id"].to_numpy()).tolist() == kept
    assert len(curate(small_lake, load_pool(small_lake, PARTITION), "RuleBased_General", 6, 0).ids) == 16


def test_an_unknown_selector_names_the_nearest(small_lake: Lake) -> None:
    with pytest.raises(UnknownNameError, match="did you mean KMeans_Hybrid"):
        curate(small_lake, load_pool(small_lake, PARTITION), "KMean_Hybrid", 1, 0)


def test_a_selector_of_ones_own_may_look_at_waypoints(small_lake: Lake) -> None:
    class Straightness(Settings):
        share: float = 0.5

    @selector("Straightest", Straightness)
    def straightest(problem: Problem, settings: Straightness) -> Kept:
        """Keep the candidates whose first step is the smallest."""
        ids = problem.pool.candidates["trajectory_id"].to_pylist()
        first_step = [abs(q[1] - q[0]).sum() for q in problem.waypoints(ids)]
        return Kept(sorted(range(len(ids)), key=first_step.__getitem__)[: problem.budget])

    assert "Straightest" in selector_names()
    selection = curate(small_lake, load_pool(small_lake, PARTITION), "Straightest", 3, 0)
    assert len(selection.ids) == 3


@pytest.fixture
def estimated() -> None:
    """A selector that says how stably it ranks."""

    @selector("Estimated", estimated=True)
    def first(problem: Problem, settings: Settings) -> Kept:
        """Keep the first candidates, with scores that are estimated from rollouts."""
        return Kept(np.arange(problem.budget), split_half=0.25)


def test_how_stably_scores_rank_is_kept_once_for_all_studies(small_lake: Lake, estimated: None) -> None:
    pool = load_pool(small_lake, PARTITION)
    first = curate(small_lake, pool, "Estimated", 3, 0)
    again = curate(small_lake, pool, "Estimated", 3, 0, study="two-12345678")
    curate(small_lake, pool, "Random", 3, 0)
    assert first.selection_id == again.selection_id
    assert small_lake.sql("SELECT selection_id, split_half FROM rankings").to_pylist() == [
        {"selection_id": first.selection_id, "split_half": 0.25}
    ]


def test_a_damaged_part_of_rankings_is_made_again_beside_the_selection_that_is_there(
    small_lake: Lake, estimated: None
) -> None:
    pool = load_pool(small_lake, PARTITION)
    first = curate(small_lake, pool, "Estimated", 3, 0)
    before = small_lake.read("rankings", PARTITION)
    path = small_lake.folder("rankings", PARTITION) / f"part-{first.selection_id}.parquet"
    path.write_bytes(path.read_bytes()[:-1])
    assert [damage.path for damage in mend(small_lake, "rankings", PARTITION)] == [path]
    again = curate(small_lake, pool, "Estimated", 3, 0)
    assert small_lake.read("rankings", PARTITION).equals(before)
    assert (again.ids, again.selection_time_s) == (first.ids, first.selection_time_s)
    assert small_lake.damage() == []


@pytest.mark.parametrize(("says", "split_half"), [(True, None), (False, 0.25)])
def test_a_selector_that_ranks_otherwise_than_it_says_is_a_mistake(
    small_lake: Lake, says: bool, split_half: float | None
) -> None:
    @selector("Confused", estimated=says)
    def confused(problem: Problem, settings: Settings) -> Kept:
        """Keep the first candidates."""
        return Kept(np.arange(problem.budget), split_half=split_half)

    with pytest.raises(ValueError, match=f"Confused: estimated={says}, but split_half={split_half}"):
        curate(small_lake, load_pool(small_lake, PARTITION), "Confused", 3, 0)
