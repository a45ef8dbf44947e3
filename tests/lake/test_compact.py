"""Merging of parts, also while others read and write."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path

import duckdb
import pyarrow as pa
import pytest

from plancurate.errors import PlancurateError
from plancurate.tasks.lake.catalog import write_catalog
from plancurate.tasks.lake.compact import compact
from plancurate.tasks.lake.manifest import read_manifest
from plancurate.tasks.lake.schema import table
from plancurate.tasks.lake.store import Lake

from ..processes import processes

POOL = {"robot": "h2017", "scene": "free", "pool": "0123"}
PARTS = 40


def rows(first: int, count: int = 2) -> pa.Table:
    same = {"y": 0.0, "z": 0.5, "goals": [[0.1, 0.2]]}
    ids = range(first, first + count)
    return pa.Table.from_pylist(
        [{"target_id": i, "x": float(i), **same} for i in ids], table("targets").schema
    )


def fill(lake: Lake, first: int, parts: int) -> None:
    for part in range(first, first + parts):
        lake.write("targets", POOL, f"{part:03d}", rows(2 * part), {})


def files(lake: Lake) -> list[Path]:
    return sorted(lake.folder("targets", POOL).glob("part-*.parquet"))


@pytest.fixture
def lake(tmp_path: Path) -> Lake:
    lake = Lake(tmp_path / "lake")
    fill(lake, 0, 5)
    return lake


def test_rows_and_keys_are_the_same_before_between_and_after(lake: Lake) -> None:
    before, keys = lake.read("targets", POOL), lake.keys("targets", POOL)
    for expected_files, expected_removed in ((6, 0), (1, 5), (1, 0)):
        assert compact(lake, "targets", POOL, {}, grace_s=0) == expected_removed
        assert len(files(lake)) == expected_files
        assert lake.read("targets", POOL).equals(before)
        assert lake.keys("targets", POOL) == keys
        assert lake.damage() == []
    assert list(read_manifest(lake.folder("targets", POOL)).entries) == [files(lake)[0].name]


def test_a_removal_that_was_killed_leaves_nothing_that_looks_damaged(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    unlink = Path.unlink

    def unlink_one(path: Path, **choices: bool) -> None:
        unlink(path, **choices)
        raise KeyboardInterrupt

    before = lake.read("targets", POOL)
    compact(lake, "targets", POOL, {}, grace_s=600)
    with monkeypatch.context() as killed:
        killed.setattr(Path, "unlink", unlink_one)
        with pytest.raises(KeyboardInterrupt):
            compact(lake, "targets", POOL, {}, grace_s=0)
    assert len(files(lake)) == 5
    assert lake.damage() == []
    assert lake.read("targets", POOL).equals(before)
    assert compact(lake, "targets", POOL, {}, grace_s=0) == 4


def test_a_damaged_part_is_not_merged(lake: Lake) -> None:
    files(lake)[1].write_bytes(files(lake)[0].read_bytes())
    with pytest.raises(PlancurateError, match=r"part-001\.parquet: changed"):
        compact(lake, "targets", POOL, {}, grace_s=0)
    assert len(files(lake)) == 5


def test_parts_stay_until_the_grace_time_is_over(lake: Lake) -> None:
    compact(lake, "targets", POOL, {})
    assert compact(lake, "targets", POOL, {}) == 0
    assert len(files(lake)) == 6
    merged = next(path for path in files(lake) if "~" in path.name)
    os.utime(merged, (time.time() - 601,) * 2)
    assert compact(lake, "targets", POOL, {}) == 5
    assert files(lake) == [merged]


def test_a_merged_part_is_not_written_again(lake: Lake) -> None:
    compact(lake, "targets", POOL, {}, grace_s=0)
    compact(lake, "targets", POOL, {}, grace_s=0)
    lake.write("targets", POOL, "003", rows(900), {})
    assert len(files(lake)) == 1
    assert 900 not in lake.read("targets", POOL)["target_id"].to_pylist()


def test_new_parts_are_merged_with_the_merged_one(lake: Lake) -> None:
    for _ in range(2):
        compact(lake, "targets", POOL, {}, grace_s=0)
    fill(lake, 5, 2)
    for _ in range(2):
        compact(lake, "targets", POOL, {}, grace_s=0)
    assert len(files(lake)) == 1
    assert lake.read("targets", POOL)["target_id"].to_pylist() == list(range(14))
    assert lake.keys("targets", POOL) == {f"{part:03d}" for part in range(7)}


def test_overlapping_merges_and_a_killed_removal_change_nothing(lake: Lake) -> None:
    compact(lake, "targets", POOL, {}, grace_s=600)
    fill(lake, 5, 1)
    compact(lake, "targets", POOL, {}, grace_s=600)  # a second merged part over the first and its parts
    assert len(files(lake)) == 8
    files(lake)[2].unlink()
    next(path for path in files(lake) if "~" in path.name).unlink()
    assert lake.read("targets", POOL)["target_id"].to_pylist() == list(range(12))


def test_trajectories_keep_their_waypoints(small_lake: Lake) -> None:
    partition = {"robot": "h2017", "scene": "free", "pool": "0a1b2c", "planner": "RRT"}
    before = small_lake.read("trajectories", partition)
    for _ in range(2):
        compact(small_lake, "trajectories", partition, {"package": "0"}, grace_s=0)
    folder = small_lake.folder("trajectories", partition)
    assert sorted(path.suffix for path in folder.iterdir()) == [".jsonl", ".parquet"]
    assert small_lake.read("trajectories", partition).equals(before)


def look_through_lake(root: Path) -> list[int]:
    return list(Lake(root / "lake").read("targets", POOL)["target_id"].to_pylist())


def look_through_catalog(root: Path) -> list[int]:
    """What another tool sees; only an error may tell it that a part has gone."""
    while True:
        try:
            with duckdb.connect(str(root / "lake" / "catalog.duckdb"), read_only=True) as connection:
                found = connection.sql("SELECT * FROM targets WHERE robot = 'h2017' ORDER BY target_id")
                return [row[3] for row in found.fetchall() if row[3] == row[4]]
        except duckdb.IOException:
            continue


def read_on(root: Path, look: Callable[[Path], list[int]]) -> None:
    """Read until told to stop; every look must show the first rows once each and no row twice."""
    with (root / f"looks-{look.__name__}").open("a", buffering=1) as looks:
        while not (root / "stop").exists():
            ids = look(root)
            assert ids == list(range(len(ids)))
            assert len(ids) >= 2 * PARTS
            looks.write("one\n")


def write_on(root: Path) -> None:
    """Add parts until told to stop."""
    lake = Lake(root / "lake")
    part = PARTS
    while not (root / "stop").exists():
        fill(lake, part, 1)
        part += 1
        time.sleep(0.02)


@pytest.mark.slow
def test_readers_at_work_see_every_row_once(tmp_path: Path) -> None:
    lake = Lake(tmp_path / "lake")
    fill(lake, 0, PARTS)
    write_catalog(lake.root)
    jobs = ((read_on, look_through_lake), (read_on, look_through_catalog), (write_on,))
    at_work = [processes.Process(target=job, args=(tmp_path, *how)) for job, *how in jobs]
    for process in at_work:
        process.start()
    removed, looks, end = 0, 0, time.monotonic() + 40
    while (removed < 2 * PARTS or looks < 20) and time.monotonic() < end:
        removed += compact(lake, "targets", POOL, {}, grace_s=0.5)
        looks = min((len(path.read_text().split()) for path in tmp_path.glob("looks-*")), default=0)
        time.sleep(0.05)
    (tmp_path / "stop").touch()
    for process in at_work:
        process.join(30)
    assert [process.exitcode for process in at_work] == [0, 0, 0]
    assert len(list(tmp_path.glob("looks-*"))) == 2
    assert removed >= PARTS
    assert looks >= 5
