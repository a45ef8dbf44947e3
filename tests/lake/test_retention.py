"""What nobody refers to goes, what something refers to stays, and the lake is sound afterwards."""

from __future__ import annotations

import fcntl
import os
import time
from collections.abc import Iterable
from pathlib import Path

import pytest

from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.locks import write_note
from plancurate.tasks.lake.compact import compact
from plancurate.tasks.lake.home import Home
from plancurate.tasks.lake.retention import Item, drop, unreferred
from plancurate.tasks.lake.status import lake_status
from plancurate.tasks.lake.store import Lake

from ..lakes import POOL
from ..studies import LABELLING, StudyMaker

OTHER = {**POOL, "pool": "0f0f0f"}


@pytest.fixture
def home(small_lake: Lake, maker: StudyMaker) -> Home:
    """Two studies of the small pool, one of them of another pool too, and a network for each and for nobody."""
    home = Home(small_lake.root.parent)
    first = maker.record("first", "aaaaaaaa")
    second = maker.record("second", "bbbbbbbb", pools=[(POOL, ""), (OTHER, "more")])
    maker.label({"t0000-RRT-r0-0a1b2c": "g0.p0"})
    maker.select(first, "KMeans", 1, [(0, "RRT", 0)])
    maker.select(second, "Random", 1, [(1, "RRT", 0)])
    maker.test(first, "KMeans", 1, "BC_MLP", "S.")
    maker.test(second, "Random", 1, "BC_MLP", "..")
    maker.test(second, "Random", 1, "BC_MLP", "..", pool=OTHER)
    for name in ("KMeans-1-BC_MLP-0-0-0", "Random-1-BC_MLP-0-0-0", "BC_RNN-s0-nobody"):
        (home.models / name).mkdir(parents=True)
        (home.models / name / "weights").write_bytes(b"1234")
    return home


def shown(found: Iterable[Item]) -> set[tuple[str, str]]:
    return {(item.kind, item.name) for item in found}


def test_only_what_no_study_refers_to_is_found(home: Home, maker: StudyMaker) -> None:
    assert shown(unreferred(home, keep_days=0)) == {("network", "BC_RNN-s0-nobody")}
    maker.select("gone-cccccccc", "Random", 1, [(0, "RRT", 0)])
    maker.test("gone-cccccccc", "Random", 1, "BC_MLP", "S", pool={**POOL, "pool": "0e0e0e"})
    maker.label({"t0000-RRT-r0-0a1b2c": "g0.p0"}, labelling="0dd0")
    (home.lake / "trajectories" / ".part-x.parquet.0a.tmp").write_bytes(b"half")
    assert shown(unreferred(home, keep_days=0)) == {
        ("network", "BC_RNN-s0-nobody"),
        ("study", "gone-cccccccc"),
        ("pool", "0e0e0e"),
        ("labelling", "0dd0"),
        ("leftover", ".part-x.parquet.0a.tmp"),
    }


def test_what_changed_lately_stays(home: Home) -> None:
    assert unreferred(home, keep_days=1) == []
    assert shown(unreferred(home, keep_days=1, now=time.time() + 2 * 86400)) == {
        ("network", "BC_RNN-s0-nobody")
    }
    old = time.time() - 3 * 86400
    os.utime(home.models / "BC_RNN-s0-nobody" / "weights", (old, old))
    assert shown(unreferred(home, keep_days=2)) == {("network", "BC_RNN-s0-nobody")}


@pytest.mark.parametrize(
    ("name", "holders"),
    [
        (POOL["pool"], "first-aaaaaaaa, second-bbbbbbbb refer to it"),
        (OTHER["pool"], "second-bbbbbbbb refers to it"),
        ("KMeans-1-BC_MLP-0-0-0", "first-aaaaaaaa refers to it"),
        (LABELLING, "first-aaaaaaaa, second-bbbbbbbb refer to it"),
    ],
)
def test_what_something_refers_to_is_refused_with_its_name(home: Home, name: str, holders: str) -> None:
    with pytest.raises(PlancurateError, match=holders):
        unreferred(home, [name])


def test_an_unknown_name_is_refused(home: Home) -> None:
    with pytest.raises(UnknownNameError, match="did you mean first-aaaaaaaa"):
        unreferred(home, ["first-aaaaaaab"])


def test_a_study_goes_with_what_only_it_refers_to(home: Home) -> None:
    found = unreferred(home, ["second-bbbbbbbb"])
    assert shown(found) == {
        ("study", "second-bbbbbbbb"),
        ("pool", OTHER["pool"]),
        ("network", "Random-1-BC_MLP-0-0-0"),
    }
    drop(home, found)
    assert Lake(home.lake).damage() == []
    lake = Lake(home.lake)
    assert lake.sql("SELECT DISTINCT study FROM studies")["study"].to_pylist() == ["first-aaaaaaaa"]
    assert lake.sql("SELECT DISTINCT selector FROM selections")["selector"].to_pylist() == ["KMeans"]
    assert lake.sql("FROM trajectories").num_rows == 18
    assert sorted(path.name for path in home.models.iterdir()) == [
        "BC_RNN-s0-nobody",
        "KMeans-1-BC_MLP-0-0-0",
    ]
    assert sorted(path.name for path in home.root.iterdir()) == ["lake", "models"]


def test_all_studies_of_a_pool_take_it_with_them(home: Home) -> None:
    drop(home, unreferred(home, ["first-aaaaaaaa", "second-bbbbbbbb", POOL["pool"]]))
    assert Lake(home.lake).sql("FROM trajectories").num_rows == 0
    assert Lake(home.lake).damage() == []


def test_nothing_is_dropped_while_somebody_works_on_a_study(home: Home) -> None:
    home.locks.mkdir()
    with (home.locks / "first-aaaaaaaa.lock").open("a+") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        write_note(file, {})
        with pytest.raises(
            PlancurateError, match=f"process {os.getpid()} is at work on study first-aaaaaaaa"
        ):
            drop(home, unreferred(home, keep_days=0))
    assert (home.models / "BC_RNN-s0-nobody").exists()


def test_a_damaged_record_of_a_study_hides_nothing(home: Home) -> None:
    part = next((home.lake / "studies" / "study=first-aaaaaaaa").glob("part-*"))
    part.write_bytes(b"changed")
    with pytest.raises(PlancurateError, match="changed since it was written"):
        unreferred(home, keep_days=0)


@pytest.mark.slow
def test_the_status_counts_what_the_tables_hold(home: Home) -> None:
    lake = Lake(home.lake)
    found = lake_status(lake)
    for name, size in found.tables.items():
        assert size.rows == lake.sql(f"FROM {name}").num_rows, name
    assert found.tables["trajectories"].parts == 6
    folders = (home.lake / "trajectories").glob("robot=h2017/**/part-*.parquet")
    assert found.tables["trajectories"].bytes == sum(path.stat().st_size for path in folders)
    small, other = found.pools
    assert (small.pool, small.targets, small.runs) == (POOL["pool"], 3, 18)
    assert small.studies == ("first-aaaaaaaa", "second-bbbbbbbb")
    assert (other.pool, other.runs, other.studies) == (OTHER["pool"], 0, ("second-bbbbbbbb",))


def test_merged_parts_are_counted_once(home: Home) -> None:
    lake = Lake(home.lake)
    compact(lake, "trajectories", {**POOL, "planner": "RRT"}, {})
    size = lake_status(lake).tables["trajectories"]
    assert (size.parts, size.rows) == (4, 18)


def test_a_home_without_a_lake_has_no_status(tmp_path: Path) -> None:
    with pytest.raises(PlancurateError, match="no lake"):
        lake_status(Lake(tmp_path / "lake"))
