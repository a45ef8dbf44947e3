"""Writers that are killed or collide; this file is also the program that the writers run."""

from __future__ import annotations

import random
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from plancurate.tasks.lake.mend import mend
from plancurate.tasks.lake.parts import sweep
from plancurate.tasks.lake.schema import table
from plancurate.tasks.lake.store import Lake

POOL = {"robot": "h2017", "scene": "free", "pool": "0123"}
ROWS_A_PART = 2000


def big_part(key: int) -> pa.Table:
    """Some tenths of a second of writing: the kill shall find a file half written."""
    numbers = np.random.default_rng(key).random((ROWS_A_PART, 3))
    columns = {"target_id": np.arange(ROWS_A_PART, dtype=np.int32) + key * ROWS_A_PART}
    columns |= dict(zip("xyz", numbers.T, strict=True))
    goals = [[[float(value)] * 12] * 4 for value in numbers[:, 0]]
    return pa.table({**columns, "goals": goals}).cast(table("targets").schema)


def write_for_ever(root: str) -> None:
    parts = [big_part(key) for key in range(4)]
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    for attempt in range(10_000):
        for key, rows in enumerate(parts):
            Lake(Path(root)).write("targets", POOL, f"{attempt:05d}-{key}", rows, {})


def write_when_told(root: str) -> None:
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    sys.stdin.readline()
    Lake(Path(root)).write("targets", POOL, "same", big_part(0), {})


def start_ready(job: str, root: Path) -> subprocess.Popen[bytes]:
    """Run a function of this file in a process of its own; returns when it is ready."""
    command = [sys.executable, __file__, job, str(root)]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert process.stdout is not None
    assert process.stdout.readline() == b"ready\n"
    return process


def test_a_killed_writer_leaves_whole_parts_or_none(tmp_path: Path) -> None:
    chance = random.Random(0)
    torn = 0
    for attempt in range(8):
        root = tmp_path / str(attempt // 4)  # four kills in the same lake
        with start_ready("write_for_ever", root) as writer:
            time.sleep(chance.uniform(0.03, 0.3))
            writer.kill()
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


def test_writers_of_the_same_part_at_the_same_time_leave_one_sound_part(tmp_path: Path) -> None:
    writers = [start_ready("write_when_told", tmp_path) for _ in range(3)]
    for writer in writers:
        assert writer.stdin is not None
        writer.stdin.write(b"go\n")
        writer.stdin.flush()
    for writer in writers:
        writer.communicate(timeout=60)
        assert writer.returncode == 0
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


if __name__ == "__main__":
    {"write_for_ever": write_for_ever, "write_when_told": write_when_told}[sys.argv[1]](sys.argv[2])
