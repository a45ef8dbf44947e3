from __future__ import annotations

import shutil
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from plancurate.robots import load_robot, load_scene
from plancurate.sql import names
from plancurate.tasks.candidates.settings import TimingSettings
from plancurate.tasks.curation.curate import curate
from plancurate.tasks.curation.learning_settings import LearningSettings
from plancurate.tasks.curation.pool import load_pool
from plancurate.tasks.curation.selector_choice import SelectorChoice
from plancurate.tasks.lake.audits import failed_audits
from plancurate.tasks.lake.manifest import list_files
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.learning.settings import EvaluateSettings, TrainSettings

from ..lakes import copied
from ..studies import StudyMaker

LEARNING = LearningSettings(TrainSettings(), EvaluateSettings(), TimingSettings())
POOL = {"robot": "h2017", "scene": "free", "pool": "0a1b2c"}
LEARNING = LearningSettings(TrainSettings(), EvaluateSettings(), TimingSettings())


@pytest.fixture(scope="module")
def curated_once(small_lake_once: Lake, tmp_path_factory: pytest.TempPathFactory) -> Lake:
    """The small lake with two selections."""
    lake = copied(small_lake_once, tmp_path_factory.mktemp("curated"))
    record_selections(lake, "one-1")
    return lake


@pytest.fixture
def curated(curated_once: Lake, tmp_path: Path) -> Lake:
    """A copy of the curated lake to write into."""
    return copied(curated_once, tmp_path)


def record_selections(lake: Lake, study: str) -> None:
    """Two selections of a study."""
    maker = StudyMaker(lake)
    maker.record(*study.split("-"))
    maker.label({f"t0000-{planner}-r0-{POOL['pool']}": "g0.p0" for planner in ("RRT", "PRM")})
    pool, robot, scene = load_pool(lake, POOL), load_robot("h2017"), load_scene("free")
    for name in ("General", "KMeans_Hybrid"):
        choice = SelectorChoice(name=name)
        curate(lake, pool, study, choice, 2, 0, robot=robot, scene=scene, learning=LEARNING, metadata={})


def spoil(folder: Path, column: str, value: object) -> None:
    """Set a column of every part below the folder to one value."""
    for path in folder.rglob("part-*.parquet"):
        rows = pq.read_table(path, partitioning=None)
        index = rows.column_names.index(column)
        same = pa.repeat(pa.scalar(value, rows.schema.field(column).type), rows.num_rows)
        pq.write_table(rows.set_column(index, rows.schema.field(column), same), path)
        list_files(path.parent, [part.name for part in path.parent.glob("part-*.parquet")])


@pytest.mark.slow
def test_a_sound_lake_passes_every_check(curated: Lake) -> None:
    assert failed_audits(curated) == {}
    assert len(names("audits")) >= 10


@pytest.mark.slow
@pytest.mark.parametrize(
    ("table", "column", "value", "check"),
    [
        ("trajectories", "joint_movement", 5.0, "assert_metrics_follow_from_waypoints"),
        ("trajectories", "n_waypoints", 12, "assert_metrics_follow_from_waypoints"),
        ("trajectories", "final_distance", 0.1, "assert_metrics_follow_from_waypoints"),
        ("trajectories", "duration", 0.55, "assert_metrics_follow_from_waypoints"),
        ("trajectories", "solved", True, "assert_only_solved_trajectories_have_waypoints"),
        ("trajectories", "reason", "", "assert_unsolved_trajectories_have_a_reason"),
        ("trajectories", "verified", True, "assert_verified_trajectories_are_solved"),
        ("trajectories", "verified", False, "assert_selected_trajectories_are_solved_and_verified"),
        ("trajectories", "trajectory_id", "same", "assert_trajectory_ids_are_unique"),
        ("trajectories", "target_x", 0.0, "assert_trajectories_lead_to_a_target"),
        ("trajectories", "verified", False, "assert_candidates_have_ways"),
        ("ways", "way", None, "assert_candidates_have_ways"),
        ("ways", "target_id", 1, "assert_candidates_have_ways"),
        ("ways", "trajectory_id", "unknown", "assert_candidates_have_ways"),
        ("targets", "target_id", 9, "assert_trajectories_lead_to_a_target"),
        ("selections", "budget", 1, "assert_selections_keep_to_their_budget"),
    ],
)
def test_each_check_finds_its_fault(
    curated: Lake, table: str, column: str, value: object, check: str
) -> None:
    spoil(curated.root / table / "robot=h2017", column, value)
    assert check in failed_audits(curated)


@pytest.mark.parametrize(
    ("target_id", "broken"), [(0, {}), (9, {"assert_corrections_lead_to_training_targets": 1})]
)
def test_a_correction_on_the_way_to_anything_but_a_training_target_is_found(
    curated: Lake, target_id: int, broken: dict[str, int]
) -> None:
    row = {
        "correction_id": "one", "network_id": "after", "parent": "before", "round": 1, "selection_id": "General",
        "policy": "BC_MLP", "seed": 0, "target_id": target_id, "step": 3, "failure": "lost", "q": [[0.0], [1.0]],
    }  # fmt: skip
    curated.write("corrections", POOL, "after", pa.Table.from_pylist([row]), {})
    assert failed_audits(curated) == broken


def test_selections_without_their_trajectories_are_found(curated: Lake) -> None:
    shutil.rmtree(curated.root / "trajectories" / "robot=h2017")
    kept = curated.sql("SELECT selection_id FROM selections").num_rows
    assert failed_audits(curated) == {
        "assert_candidates_have_ways": 2,
        "assert_selected_trajectories_are_solved_and_verified": kept,
    }


@pytest.mark.slow
def test_the_audits_of_a_study_look_at_nothing_of_its_neighbours(curated: Lake) -> None:
    record_selections(curated, "other-1")
    spoil(curated.folder("selections", {**POOL, "study": "other-1"}), "budget", 1)
    assert failed_audits(curated, {**POOL, "study": "one-1"}) == {}
    assert list(failed_audits(curated, {**POOL, "study": "other-1"})) == [
        "assert_selections_keep_to_their_budget"
    ]
