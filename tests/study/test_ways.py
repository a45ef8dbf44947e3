"""Ways of a study's candidates: when they are labelled, beside which others, where they are seen."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from plancurate.tasks.candidates.path_classes import label_paths
from plancurate.tasks.curation.pool import make_pool
from plancurate.tasks.lake.audits import failed_audits
from plancurate.tasks.lake.home import Home
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study import text
from plancurate.tasks.study.candidates import make_part, missing_parts, study_targets
from plancurate.tasks.study.config import load_config
from plancurate.tasks.study.context import StudyContext, open_study
from plancurate.tasks.study.pools import study_pools
from plancurate.tasks.study.records import record_study
from plancurate.tasks.study.selections import study_pool
from plancurate.tasks.study.ways import BLOCKS, blocks, label_ways, unlabelled

TWO = ("RRTConnect", "EST")
CANDIDATES = {
    "targets": {"orientation": "cone"},
    "plan": {"runs": 2, "simplification": "off", "goals": "pose"},
}


def opened(home: Path, planners: tuple[str, ...] = TWO) -> StudyContext:
    fields = {"planners": planners, "candidates": CANDIDATES, "scenes": ["table"], "n_targets": 2}
    return open_study(load_config("smoke", None, fields), Home(home))


def plan(study: StudyContext, number: int | None = None) -> None:
    """Plan that many of the missing parts, or all."""
    (pool,) = study.pools
    for part in missing_parts(study, pool, study_targets(study, pool))[:number]:
        make_part(study, part)


def label(study: StudyContext) -> list[int]:
    return [label_ways(study, block) for block in unlabelled(study)]


@pytest.fixture(scope="module")
def labelled(tmp_path_factory: pytest.TempPathFactory) -> StudyContext:
    """Two planners' two runs to two targets of the table, labelled."""
    study = opened(tmp_path_factory.mktemp("home"))
    plan(study)
    label(study)
    record_study(study)
    return study


@pytest.mark.slow
def test_a_target_is_labelled_when_all_its_planners_have_planned(tmp_path: Path) -> None:
    study = opened(tmp_path)
    plan(study, 1)
    assert unlabelled(study) == []
    plan(study, 2)  # both planners' for target 0, one planner's for target 1
    assert [block.targets for block in unlabelled(study)] == [(0,)]
    label(study)
    plan(study)
    assert [block.targets for block in unlabelled(study)] == [(1,)]
    assert label(study) == [4]
    assert unlabelled(study) == []


@pytest.mark.slow
def test_ways_are_the_labels_of_all_candidates_of_a_target(labelled: StudyContext) -> None:
    (pool,) = labelled.pools
    rows = labelled.lake.sql(
        f"SELECT target_id, verified, q, way FROM study_candidates('{labelled.study}') ORDER BY trajectory_id"
    ).to_pylist()
    assert len(rows) == 8
    candidates = [row for row in rows if row["verified"]]
    paths, targets = [np.array(row["q"]) for row in candidates], [row["target_id"] for row in candidates]
    assert [row["way"] for row in candidates] == label_paths(pool.robot, pool.scene, paths, targets)
    assert all(row["way"] is None for row in rows if not row["verified"])
    assert len({(row["target_id"], row["way"]) for row in candidates}) > 2
    assert failed_audits(labelled.lake) == {}


def test_selectors_see_ways_and_pools_with_other_ways_are_others(labelled: StudyContext) -> None:
    (pool,) = labelled.pools
    loaded = study_pool(labelled, pool)
    names = loaded.candidates["trajectory_id"].to_pylist()
    stored = labelled.lake.sql("SELECT trajectory_id, way FROM ways").to_pylist()
    way = {row["trajectory_id"]: row["way"] for row in stored}
    assert loaded.candidates["way"].to_pylist() == [way[name] for name in names]
    columns = [name for name in loaded.candidates.column_names if name != "way"]
    assert make_pool(pool.partition, loaded.candidates.select(columns), loaded.targets).hash != loaded.hash


def test_other_planners_are_labelled_apart(labelled: StudyContext) -> None:
    alone = opened(labelled.home.root, TWO[:1])
    before = labelled.lake.sql("SELECT * FROM ways").num_rows
    assert alone.labelling != labelled.labelling
    assert opened(labelled.home.root, TWO[::-1]).labelling == labelled.labelling
    assert [block.targets for block in unlabelled(alone)] == [(0, 1)]
    label(alone)
    record_study(alone)
    own, both = (
        labelled.lake.sql(f"SELECT way FROM study_candidates('{study.study}') WHERE verified").to_pylist()
        for study in (alone, labelled)
    )
    assert len(own) * 2 == len(both)
    assert None not in [row["way"] for row in own + both]
    assert labelled.lake.sql("SELECT * FROM ways").num_rows == before + len(own)


@pytest.mark.slow
def test_a_pool_counts_goal_configurations_and_ways_a_target(small_lake: Lake, maker: Any) -> None:
    study = maker.record("tiny", "aaaaaaaa")
    (pool,) = study_pools(small_lake, study)
    assert (pool.goal_classes, pool.ways) == (None, None)
    assert text.pool(pool) == "16 candidates to 3 targets, 16 distinct (100.0 %, 5.3 a target)"
    ways = {0: ["g0.p0", "g0.p1", "g1.p0"], 1: ["g0.p0"], 2: ["g0.p0", "g0.p1", "g0.p0"]}
    labels = {
        f"t{target:04d}-{planner}-r{run}-0a1b2c": way
        for target, own in ways.items()
        for planner in ("RRT", "PRM")
        for run, way in enumerate(own)
    }
    maker.label(labels)
    maker.label(dict.fromkeys(labels, "g9.p9"), labelling="0ther")
    (pool,) = study_pools(small_lake, study)
    assert (pool.goal_classes, pool.ways) == (4 / 3, 6 / 3)
    assert text.pool(pool).endswith("1.3 goal configurations and 2.0 ways a target")


@pytest.mark.parametrize(
    ("targets", "parts"), [(0, 0), (16, 1), (17, 2), (1024, 64), (1025, 61), (10**6, BLOCKS)]
)
def test_a_larger_pool_is_labelled_in_larger_blocks_not_in_ever_more(targets: int, parts: int) -> None:
    found = blocks("pool", range(targets))
    assert len(found) == parts
    assert [target for block in found for target in block.targets] == list(range(targets))
