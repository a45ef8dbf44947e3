"""A small study with a round of corrections, on the command line: what it leaves, and what doing it again does."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from plancurate import native
from plancurate.robots import load_world
from plancurate.tasks.lake.audits import failed_audits
from plancurate.tasks.lake.home import Home
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study.config import StudyConfig, load_config
from plancurate.tasks.study.context import open_study
from plancurate.tasks.study.demonstrations import selected_demonstrations
from plancurate.tasks.study.evaluations import drawn_tests, evaluation_id
from plancurate.tasks.study.networks import load_network, wanted_networks
from plancurate.tasks.study.results import study_results
from plancurate.tasks.study.selections import study_selections

from .conftest import Command, Studied
from .test_study import parts

FIELDS = {
    "name": "corrected", "scenes": ["table"], "n_targets": 4, "planners": ["RRTConnect", "PRM"], "unseen": 4,
    "selectors": ["RuleBased_General"], "budgets": [2], "policies": ["BC_MLP"],
    "training": {"demonstration_steps": "arc", "steps": 300}, "corrections": {"rounds": 1},
}  # fmt: skip


@pytest.fixture(scope="module")
def config() -> StudyConfig:
    return load_config("smoke", None, FIELDS)


@pytest.fixture(scope="module")
def words(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, ...]:
    """Options of the study: its file and its home."""
    home = tmp_path_factory.mktemp("corrected")
    file = home / "corrected.yaml"
    file.write_text(json.dumps(FIELDS))
    return ("--preset", "smoke", "--config", str(file), "--home", str(home))


@pytest.fixture(scope="module")
def corrected(plancurate: Command, words: tuple[str, ...]) -> Studied:
    done = plancurate("study", *words)
    assert done.returncode == 0, done.stderr
    return Studied(Path(words[-1]), Path(words[-1]), done.stdout, done.stderr)


def test_every_round_has_its_row_and_the_headline_is_of_the_last(
    corrected: Studied, config: StudyConfig
) -> None:
    study = open_study(config, Home.resolve(corrected.home))
    results = study_results(study.lake, study.study)
    rows = [row.report() for row in results.headline.networks]
    assert [(row["round"], row["n"]) for row in rows] == [(0, 4), (1, 4)]
    (summary,) = results.headline.summaries
    assert (summary.successes, summary.n, summary.final_distance) == (
        rows[1]["successes"],
        4,
        rows[1]["final_distance"],
    )
    assert rows[0]["final_distance"] != rows[1]["final_distance"]


def test_corrections_lead_from_visited_states_to_training_targets_and_never_to_a_test(
    corrected: Studied, config: StudyConfig
) -> None:
    lake, study = Lake(corrected.home / "lake"), open_study(config, Home.resolve(corrected.home))
    robot, scene = load_world("h2017", "table")
    rows = lake.sql(
        "SELECT c.*, t.x, t.y, t.z FROM corrections c JOIN targets t USING (target_id)"
    ).to_pylist()
    before, after = wanted_networks(study, study_selections(study))
    assert rows
    assert len(rows) == lake.sql("FROM corrections").num_rows
    assert {(row["round"], row["parent"], row["network_id"]) for row in rows} == {
        (1, before.network_id, after.network_id)
    }
    tests = drawn_tests(study, study.pools[0])
    moved = tests.position[tests.distance_cm != 0]
    selection = study_selections(study)[0]
    own = selected_demonstrations(study, selection)
    ends = own.q[own.starts + own.lengths - 1]
    for row in rows:
        q = np.array(row["q"])
        assert np.linalg.norm(moved - [row["x"], row["y"], row["z"]], axis=1).min() > 1e-3
        assert np.abs(ends - q[-1]).max(axis=1).min() < 1e-6
        assert native.edge_is_free(robot.native, scene.native, q[:-1], q[1:], 0.02).all()
        assert np.abs(q[0] - robot.home).max() > 1e-3
    failures = Counter(row["target_id"] for row in rows if row["failure"])
    assert max(failures.values(), default=0) <= config.corrections.states_a_failure
    assert failed_audits(lake) == {}


def test_a_round_learns_from_its_corrections_beside_the_selection(
    corrected: Studied, config: StudyConfig
) -> None:
    study = open_study(config, Home.resolve(corrected.home))
    before, after = wanted_networks(study, study_selections(study))
    alone = selected_demonstrations(study, after.selection)
    both = selected_demonstrations(study, after.selection, [after.network_id])
    assert len(both.starts) - len(alone.starts) == study.lake.sql("FROM corrections").num_rows
    np.testing.assert_array_equal(both.q[: len(alone.q)], alone.q)
    mean = load_network(study, after).normaliser.observation_mean.numpy()
    np.testing.assert_allclose(mean, both.observations.astype(float).mean(axis=0), atol=1e-5)
    assert evaluation_id(study, before) != evaluation_id(study, after)


def test_doing_it_again_makes_nothing_and_lost_corrections_come_out_alike(
    corrected: Studied, plancurate: Command, words: tuple[str, ...]
) -> None:
    known = parts(corrected.home)
    ordered = "FROM corrections ORDER BY correction_id"
    first = Lake(corrected.home / "lake").sql(ordered)
    assert plancurate("refine", *words).returncode == 0
    assert parts(corrected.home) == known
    for file in (corrected.home / "lake" / "corrections").rglob("part-B*.parquet"):
        file.unlink()
    again = plancurate("refine", *words)
    assert "made again" in again.stderr
    assert Lake(corrected.home / "lake").sql(ordered).equals(first)
