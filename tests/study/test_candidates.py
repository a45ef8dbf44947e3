from __future__ import annotations

from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plancurate.tasks.candidates import generate
from plancurate.tasks.candidates.plan import PlannedPath, plan_candidate
from plancurate.tasks.lake.home import Home
from plancurate.tasks.lake.manifest import forget, locked
from plancurate.tasks.study.candidates import gaps, make_part, missing_parts, study_targets
from plancurate.tasks.study.config import load_config
from plancurate.tasks.study.context import StudyContext, open_study


@given(st.sets(st.integers(0, 12)), st.integers(1, 10))
def test_gaps_are_the_numbers_that_are_not_known(known: set[int], count: int) -> None:
    found = gaps(sorted(known), count)
    assert [number for first, length in found for number in range(first, first + length)] == sorted(
        set(range(count)) - known
    )
    assert all(first + length not in {other for other, _ in found} for first, length in found)


def opened(home: Path, n_targets: int) -> StudyContext:
    return open_study(load_config("smoke", None, {"n_targets": n_targets}), Home(home))


def drawn(study: StudyContext) -> list[tuple[int, list[float]]]:
    targets = study_targets(study, study.pools[0])
    return [(target.target_id, target.position.tolist()) for target in targets]


@pytest.mark.slow
def test_targets_whose_part_was_lost_are_drawn_again_as_they_were(tmp_path: Path) -> None:
    for count in (2, 4, 6):
        before = drawn(opened(tmp_path, count))
    assert [number for number, _ in before] == [0, 1, 2, 3, 4, 5]
    study = opened(tmp_path, 6)
    folder = study.lake.folder("targets", study.pools[0].partition)
    with locked(folder):
        forget(folder, ["part-000002-000003.parquet"])
    (folder / "part-000002-000003.parquet").unlink()
    assert drawn(opened(tmp_path, 6)) == before


def planned(home: Path, runs: int) -> tuple[list[int], pa.Table]:
    """Plan what a pool of so many runs lacks: how many runs each part took over, and all rows but their seconds."""
    values = {"planners": ["RRTConnect", "PRM"], "candidates": {"plan": {"runs": runs}}}
    study = open_study(load_config("smoke", None, values), Home(home))
    (pool,) = study.pools
    parts = missing_parts(study, pool, study_targets(study, pool))
    for part in parts:
        made = make_part(study, part)
        assert made.runs == runs
    assert not missing_parts(study, pool, study_targets(study, pool))
    rows = study.lake.read("trajectories", pool.partition).sort_by("trajectory_id")
    return [part.earlier for part in parts], rows.drop_columns(["plan_s", "timing_s", "verify_s"])


@pytest.mark.slow
def test_runs_that_a_smaller_pool_holds_are_taken_over_and_not_planned_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    earlier, expected = planned(tmp_path / "at_once", 3)
    assert earlier == [0, 0, 0, 0]
    planned(tmp_path / "grown", 1)
    runs: list[int] = []

    def watched(*args: Any) -> PlannedPath:
        runs.append(args[4])
        return plan_candidate(*args)

    monkeypatch.setattr(generate, "plan_candidate", watched)
    earlier, rows = planned(tmp_path / "grown", 3)
    assert earlier == [1, 1, 1, 1]
    assert sorted(runs) == [1, 1, 1, 1, 2, 2, 2, 2]
    assert rows.equals(expected)


@pytest.mark.slow
def test_what_is_damaged_in_a_smaller_pool_is_planned_again(tmp_path: Path) -> None:
    _, expected = planned(tmp_path / "at_once", 2)
    planned(tmp_path / "grown", 1)
    part = next((tmp_path / "grown").glob("lake/trajectories/robot=h2017/**/planner=PRM/part-*.parquet"))
    part.write_bytes(part.read_bytes()[:-1])
    earlier, rows = planned(tmp_path / "grown", 2)
    assert sorted(earlier) == [0, 1, 1, 1]
    assert rows.equals(expected)
