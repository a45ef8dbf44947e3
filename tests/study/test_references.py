"""What a planner, a replayed trajectory and a straight line reach, beside what policies do."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyarrow as pa
import pytest

from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study.reference_results import ReferenceRow
from plancurate.tasks.study.references import replayed
from plancurate.tasks.study.results import study_results
from plancurate.tasks.study.rows import ALL_SCENES
from plancurate.tasks.study.statistics import wilson_interval
from plancurate.tasks.study.verdict import verdicts

FREE = {"robot": "h2017", "scene": "free", "pool": "0a1b2c"}
TABLE = {"robot": "h2017", "scene": "table", "pool": "3d4e5f"}


@pytest.fixture
def study(maker: Any) -> str:
    """One policy in two scenes, tested at unseen and displaced targets; another study that must not count."""
    study = maker.record("tiny", "aaaaaaaa", pools=((FREE, ""), (TABLE, "")))
    for pool in (FREE, TABLE):
        maker.test(study, "KMeans", 2, "BC_MLP", "SR..", kind="unseen", pool=pool, hard=pool is TABLE)
        maker.test(study, "KMeans", 2, "BC_MLP", "SSSS", pool=pool)
    maker.refer(study, kind="unseen", pool=FREE, Planner="SSSS", Replay="S...", StraightLine="SSSS")
    maker.refer(study, kind="unseen", pool=TABLE, Planner="SSsh", Replay="..hs", StraightLine="SShh")
    maker.refer(study, pool=FREE, Planner="SS", Replay="S.", StraightLine="SS")
    other = maker.record("other", "bbbbbbbb")
    maker.refer(other, kind="unseen", pool=FREE, Planner="........")
    return str(study)


def counted(rows: list[ReferenceRow]) -> list[tuple[object, ...]]:
    return [(row.scene, row.reference, row.n, row.successes, row.hard_n, row.hard_successes) for row in rows]


@pytest.mark.slow
def test_references_are_counted_by_scene_and_over_all_of_them(small_lake: Lake, study: str) -> None:
    results = study_results(small_lake, study)
    rows = results.on("unseen").references
    assert counted(rows) == [
        (ALL_SCENES, "Planner", 8, 7, 2, 1),
        (ALL_SCENES, "Replay", 8, 2, 2, 1),
        (ALL_SCENES, "StraightLine", 8, 6, 2, 0),
        ("free", "Planner", 4, 4, 0, 0),
        ("free", "Replay", 4, 1, 0, 0),
        ("free", "StraightLine", 4, 4, 0, 0),
        ("table", "Planner", 4, 3, 2, 1),
        ("table", "Replay", 4, 1, 2, 1),
        ("table", "StraightLine", 4, 2, 2, 0),
    ]
    assert (rows[0].success_rate, rows[0].hard_rate, rows[3].hard_rate) == (7 / 8, 1 / 2, None)
    assert rows[0].interval == wilson_interval(7, 8)
    assert counted(results.on("displaced").references) == [
        ("free", "Planner", 2, 2, 0, 0),
        ("free", "Replay", 2, 1, 0, 0),
        ("free", "StraightLine", 2, 2, 0, 0),
    ]


@pytest.mark.slow
def test_the_verdict_says_how_far_the_best_selection_is_from_a_planner(small_lake: Lake, study: str) -> None:
    (verdict,) = verdicts(study_results(small_lake, study))
    assert verdict.ceiling == (
        "A planner reaches 87.5 % of these 8 targets, 37.5 points above KMeans k=2; a straight line in joint space "
        "75.0 %, the best trajectory to the nearest training target 25.0 %. At the hard targets, whose straight "
        "line is not free (2 of 8), KMeans k=2 reaches 50.0 %, a planner 50.0 %."
    )
    assert verdict.sentences[2] == verdict.ceiling


def test_a_replayed_trajectory_succeeds_where_it_ends_and_the_nearest_target_decides_which() -> None:
    names = ("target_x", "target_y", "target_z", "tool_x", "tool_y", "tool_z")
    best = pa.table(dict(zip(names, np.array([[0, 0, 0, 0.02, 0, 0], [1, 0, 0, 0, 0, 0.0]]).T, strict=True)))
    positions = np.array([[0.06, 0, 0], [-0.04, 0, 0], [0.4, 0, 0], [0.6, 0, 0], [1.0, 0, 0]])
    # the second target's trajectory misses it by a metre
    assert replayed(best, positions, 0.05).tolist() == [True, False, False, False, False]
    assert replayed(best, positions, 0.07).tolist() == [True, True, False, False, False]
