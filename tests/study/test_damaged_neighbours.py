"""Damage in one pool or study stops only what needs it."""

from __future__ import annotations

import shutil
from typing import Any

import pytest

from plancurate.errors import PlancurateError
from plancurate.tasks.lake.audits import failed_audits
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study.results import study_results
from plancurate.tasks.study.studies import find_study

POOL = {"robot": "h2017", "scene": "free", "pool": "0a1b2c"}


@pytest.fixture
def study(maker: Any) -> str:
    """A study of the small lake's pool."""
    study = maker.record("tiny", "aaaaaaaa")
    maker.select(study, "General", None, [(0, "PRM", 0)])
    maker.test(study, "General", None, "BC_MLP", "S.")
    return str(study)


def copy_into_damage(lake: Lake, study: str) -> None:
    """A second pool and study whose every part is misplaced: copies of the first ones under other names."""
    for name in ("trajectories", "targets", "selections", "evaluations"):
        pool = lake.root / name / "robot=h2017" / "scene=free" / "pool=0a1b2c"
        shutil.copytree(pool, pool.with_name("pool=ffffff"))
        for folder in pool.with_name("pool=ffffff").glob("study=*"):
            folder.rename(folder.with_name("study=other-bbbbbbbb"))
    folder = lake.root / "studies" / f"study={study}"
    shutil.copytree(folder, folder.with_name("study=other-bbbbbbbb"))


@pytest.mark.slow
def test_a_damaged_pool_and_study_stop_nothing_of_their_neighbours(small_lake: Lake, study: str) -> None:
    before, audits = study_results(small_lake, study), failed_audits(small_lake, {**POOL, "study": study})
    copy_into_damage(small_lake, study)
    again = Lake(small_lake.root)
    assert find_study(again, "tiny") == study
    assert study_results(again, study) == before
    assert failed_audits(again, {**POOL, "study": study}) == audits
    with pytest.raises(PlancurateError, match=r"study=other-bbbbbbbb/.*misplaced"):
        again.query("results/planners", study="other-bbbbbbbb")
    with pytest.raises(PlancurateError, match=r"pool=ffffff/.*misplaced"):
        again.query("pool/planned", **{**POOL, "pool": "ffffff"})


def test_a_damaged_part_of_a_studys_own_pool_stops_what_reads_it(small_lake: Lake, study: str) -> None:
    path = next(small_lake.folder("trajectories", {**POOL, "planner": "PRM"}).glob("part-*.parquet"))
    path.write_bytes(path.read_bytes()[:-1])
    again = Lake(small_lake.root)
    with pytest.raises(PlancurateError, match=f"{path.name}: changed"):
        again.query("results/planners", study=study)
    assert again.query("results/by_policy", study=study, kind="displaced").num_rows == 1
