"""Writers that are killed or collide."""

from __future__ import annotations

import random
import time
from multiprocessing.synchronize import Barrier, Event
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from plancurate.tasks.lake.mend import mend
from plancurate.tasks.lake.parts import STALE_AFTER_S, sweep
from plancurate.tasks.lake.schema import table
from plancurate.tasks.lake.store import Lake

from ..processes import processes

POOL = {"robot": "h2017", "scene": "free", "pool": "0123"}
ROWS_A_PART = 2000


def big_part(key: int) -> pa.Table:
    """Some tenths of a second of writing: the kill shall find a file half written."""
    numbers = np.random.default_rng(key).random((ROWS_A_PART, 3))
    columns = {"target_id": np.arange(ROWS_A_PART, dtype=np.int32) + key * ROWS_A_PART}
    columns |= dict(zip("xyz", numbers.T, strict=True))
    goals = [[[float(value)] * 12] * 4 for value in numbers[:, 0]]
    return pa.table({**columns, "goals": goals}).cast(table("targets").schema)


def write_for_ever(root: Path, ready: Event) -> None:
    parts = [big_part(key) for key in range(4)]
    ready.set()
    for attempt in range(10_000):
        for key, rows in enumerate(parts):
            Lake(root).write("targets", POOL, f"{attempt:05d}-{key}", rows, {})


def write_together(root: Path, start: Barrier) -> None:
    rows = big_part(0)
    start.wait(60)
    Lake(root).write("targets", POOL, "same", rows, {})


@pytest.mark.slow
def test_a_killed_writer_leaves_whole_parts_or_none(tmp_path: Path) -> None:
    chance = random.Random(0)
    torn = 0
    for attempt in range(8):
        root = tmp_path / str(attempt // 4)  # four kills in the same lake
        ready = processes.Event()
        writer = processes.Process(target=write_for_ever, args=(root, ready))
        writer.start()
        assert ready.wait(60)
        time.sleep(chance.uniform(0.03, 0.3))
        writer.kill()
        writer.join()
        lake = Lake(root)
        torn += len(sweep(root, older_than_s=0))
        assert not list(root.rglob(".*.tmp"))
        if not root.exists():  # killed before its first file
            continue
        mend(lake, "targets", POOL)  # a part whose entry was written and that never appeared
        assert lake.damage() == []
        for path in root.glob("targets/robot=h2017/*/*/*.parquet"):
            assert pq.read_table(path, partitioning=None).num_rows == ROWS_A_PART
    assert torn > 0  # or no kill hit the middle of a write and this test has shown nothing


@pytest.mark.slow
def test_writers_of_the_same_part_at_the_same_time_leave_one_sound_part(tmp_path: Path) -> None:
    start = processes.Barrier(3)
    writers = [processes.Process(target=write_together, args=(tmp_path, start)) for _ in range(3)]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join(60)
        assert writer.exitcode == 0
    lake = Lake(tmp_path)
    assert lake.keys("targets", POOL) == {"same"}
    assert lake.read("targets", POOL).num_rows == ROWS_A_PART
    assert lake.damage() == []
    assert not list(tmp_path.rglob(".*.tmp"))


def test_an_error_in_the_middle_of_a_write_leaves_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full_disk(rows: pa.Table, path: Path, **_: object) -> None:
        path.write_bytes(b"PAR1 and no more")
        raise OSError(28, "No space left on device")

    lake = Lake(tmp_path)
    lake.write("targets", POOL, "first", big_part(0), {})
    monkeypatch.setattr(pq, "write_table", full_disk)
    with pytest.raises(OSError, match="No space left"):
        lake.write("targets", POOL, "second", big_part(1), {})
    assert lake.keys("targets", POOL) == {"first"}
    assert not list(tmp_path.rglob(".*.tmp"))


def test_a_write_whose_file_a_clock_ahead_sweeps_away_fails_and_can_be_tried_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lake, write = Lake(tmp_path), pq.write_table
    lake.write("targets", POOL, "first", big_part(0), {})

    def swept(rows: pa.Table, path: Path, **settings: Any) -> None:
        write(rows, path, **settings)
        ahead = time.time() + STALE_AFTER_S + 1
        with monkeypatch.context() as patch:
            patch.setattr(time, "time", lambda: ahead)
            assert sweep(tmp_path) == [path]

    with monkeypatch.context() as patch:
        patch.setattr(pq, "write_table", swept)
        with pytest.raises(FileNotFoundError, match="part-second"):
            lake.write("targets", POOL, "second", big_part(1), {})
    assert lake.damage() == []
    lake.write("targets", POOL, "second", big_part(1), {})
    assert lake.keys("targets", POOL) == {"first", "second"}
    assert lake.damage() == []
