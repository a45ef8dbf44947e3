"""One policy for each cluster of a selection: what each learns from, and which tests it answers."""

from __future__ import annotations

import shutil

import numpy as np
import pyarrow.compute as pc
import pytest

from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.tasks.curation.pool import load_waypoints
from plancurate.tasks.lake.home import Home
from plancurate.tasks.learning import nearest_clusters
from plancurate.tasks.study import champions
from plancurate.tasks.study.config import load_config
from plancurate.tasks.study.context import StudyContext, open_study
from plancurate.tasks.study.demonstrations import selected_demonstrations
from plancurate.tasks.study.evaluations import (
    evaluate_networks,
    evaluation_id,
    missing_evaluations,
    own_tests,
    study_tests,
)
from plancurate.tasks.study.networks import train_networks, wanted_networks
from plancurate.tasks.study.predictor import Choice, study_policy
from plancurate.tasks.study.records import record_study
from plancurate.tasks.study.results import network_rows, study_results
from plancurate.tasks.study.selections import make_selection, study_selections
from plancurate.tasks.study.verdict import reading_steps, verdicts

from .conftest import Studied

FIELDS = {
    "selectors": ["General", {"name": "KMeans_Hybrid", "clusters": 2}],
    "policies": ["BC_MLP"],
    "training": {"steps": 5},
    "unseen": 12,
}


@pytest.fixture(scope="module")
def study(smoke: Studied, tmp_path_factory: pytest.TempPathFactory) -> StudyContext:
    """The smoke study's pool under a study with a policy for each cluster, trained and tested."""
    home = tmp_path_factory.mktemp("clusters")
    shutil.copytree(smoke.untouched / "lake", home / "lake")
    study = open_study(load_config("smoke", None, FIELDS | {"one_policy_a": "cluster"}), Home.resolve(home))
    record_study(study)
    networks = wanted_networks(study, study_selections(study))
    train_networks(study, networks)
    evaluate_networks(study, networks)
    return study


def test_each_cluster_has_a_network_that_learns_from_it_alone(study: StudyContext) -> None:
    general, *of_clusters = wanted_networks(study, study_selections(study))
    kept = make_selection(study, of_clusters[0].selection).kept
    assert general.cluster is None
    assert [network.cluster for network in of_clusters] == sorted(set(kept["cluster"].to_pylist()))
    assert len({network.network_id for network in of_clusters}) == len(of_clusters) > 1
    learnt = [
        len(selected_demonstrations(study, one.selection, cluster=one.cluster).starts) for one in of_clusters
    ]
    assert learnt == [pc.sum(pc.equal(kept["cluster"], one.cluster)).as_py() for one in of_clusters]


def test_a_test_is_left_to_the_cluster_whose_trajectories_end_nearest(study: StudyContext) -> None:
    (pool,) = study.pools
    _, *of_clusters = wanted_networks(study, study_selections(study))
    kept = make_selection(study, of_clusters[0].selection).kept
    ends = [
        np.mean([native.fk(pool.robot.native, path[-1:])[0, :3, 3] for path in paths], axis=0)
        for one in of_clusters
        for ids in [kept.filter(pc.field("cluster") == one.cluster)["trajectory_id"].to_pylist()]
        for paths in [load_waypoints(study.lake, pool.partition, ids)]
    ]
    tests = study_tests(study, pool)
    own = [own_tests(study, one) for one in of_clusters]
    for kind, test, position in zip(tests.kind, tests.test_id, tests.position, strict=True):
        nearest = int(np.argmin([np.linalg.norm(position - end) for end in ends]))
        answered = [(kind, test) in zip(one.kind, one.test_id, strict=True) for one in own]
        assert answered == [number == nearest for number in range(len(ends))]


def test_results_are_those_of_all_clusters_together(study: StudyContext) -> None:
    (pool,) = study.pools
    n = len(study_tests(study, pool))
    rows = [row for kind in ("displaced", "unseen") for row in network_rows(study.lake, study.study, kind)]
    for selector in {row.selector for row in rows}:
        assert sum(row.n for row in rows if row.selector == selector) == n
    assert missing_evaluations(study) == []


def test_no_network_of_a_cluster_is_a_champion_or_predicts(study: StudyContext) -> None:
    general, *of_clusters = wanted_networks(study, study_selections(study))
    tested = {key for of_policy in champions.tested_at_unseen(study).values() for key in of_policy}
    assert [key.startswith(general.network_id) for key in tested] == [True]
    with pytest.raises(PlancurateError, match="a policy for each cluster"):
        study_policy(study.home, Choice(study.config.name, selector=of_clusters[0].selection.choice.label))


def test_it_is_another_study_and_the_networks_of_all_that_is_kept_are_the_same(study: StudyContext) -> None:
    plain = open_study(load_config("smoke", None, FIELDS), study.home)
    assert plain.key != study.key
    ids = [{n.network_id for n in wanted_networks(one, study_selections(one))} for one in (plain, study)]
    assert len(ids[0] & ids[1]) == 1  # General's


@pytest.mark.parametrize("field", ["verified_tests", "corrections"])
def test_what_does_not_go_with_clusters_is_refused(field: str) -> None:
    wrong = {"verified_tests": 3} if field == "verified_tests" else {"corrections": {"rounds": 1}}
    steps = {"training": {"demonstration_steps": "arc"}}
    with pytest.raises(PlancurateError, match=f"{field}.* with one_policy_a = cluster it must be 0"):
        load_config("smoke", None, {"one_policy_a": "cluster"} | steps | wrong)


def test_other_ways_to_leave_tests_to_clusters_are_other_studies_and_evaluations(
    study: StudyContext, monkeypatch: pytest.MonkeyPatch
) -> None:
    general, of_cluster, *_ = wanted_networks(study, study_selections(study))
    before = [evaluation_id(study, one) for one in (general, of_cluster)]
    monkeypatch.setattr(nearest_clusters, "REVISION", nearest_clusters.REVISION + 1)
    again = open_study(study.config, study.home)
    after = [evaluation_id(again, one) for one in (general, of_cluster)]
    assert again.key != study.key
    assert (after[0] == before[0], after[1] == before[1]) == (True, False)


def test_the_verdict_says_that_clusters_have_policies_of_their_own(study: StudyContext) -> None:
    (verdict,) = verdicts(study_results(study.lake, study.study))
    assert any("a policy for each cluster" in sentence for sentence in verdict.sentences)
    plain = open_study(load_config("smoke", None, FIELDS), study.home)
    assert not list(reading_steps(plain.config.model_dump(mode="json")))
