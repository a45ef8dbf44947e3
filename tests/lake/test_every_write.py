"""Writers of the lake, killed or out of room at each write: the lake stays sound, and again gives the same."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from plancurate.tasks.lake.compact import compact
from plancurate.tasks.lake.mend import mend
from plancurate.tasks.lake.parts import sweep
from plancurate.tasks.lake.store import Lake

from ..write_faults import WriteFaults, files
from .test_damage import OTHER, POOL, rows

Job = Callable[[Path], object]


def write(root: Path) -> None:
    Lake(root).write("targets", POOL, "c", rows(2, 3), {})


def merge(root: Path) -> None:
    for _ in range(2):
        compact(Lake(root), "targets", POOL, {}, grace_s=0.0)


def put_aside(root: Path) -> None:
    mend(Lake(root), "targets", POOL)


def another_pool(root: Path) -> None:
    Lake(root).write("targets", OTHER, "o", rows(9), {})


def two_parts(root: Path) -> None:
    for key, number in (("a", 0), ("b", 1)):
        Lake(root).write("targets", POOL, key, rows(number), {})


def one_torn(root: Path) -> None:
    two_parts(root)
    part = Lake(root).folder("targets", POOL) / "part-b.parquet"
    part.write_bytes(part.read_bytes()[:-20])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "job", "before", "fewest", "held"),
    [
        ("kill", write, another_pool, 15, set()),
        ("kill", write, two_parts, 10, {"a", "b"}),
        ("kill", merge, two_parts, 15, {"a", "b"}),
        ("kill", put_aside, one_torn, 4, {"a"}),
        ("full", write, two_parts, 5, {"a", "b"}),
    ],
    ids=["first part", "further part", "compaction", "mending", "further part on a full disk"],
)
def test_a_fault_at_any_write_leaves_a_lake_that_the_same_command_finishes(
    fault: str,
    job: Job,
    before: Job,
    fewest: int,
    held: set[str],
    tmp_path: Path,
    write_faults: WriteFaults,
) -> None:
    before(tmp_path / "before")
    places = (tmp_path / "faults", tmp_path / "before")
    faulted, undisturbed = write_faults.at_every_write(fault, job, *places)
    assert len(faulted) >= fewest
    allowed = {"missing", *(problem.kind for problem in Lake(tmp_path / "before").damage())}
    for root in faulted:
        assert fault == "kill" or not list(root.rglob(".*.tmp"))
        lake = Lake(root)
        assert {problem.kind for problem in lake.damage()} <= allowed
        mend(lake, "targets", POOL)
        assert lake.damage() == []
        assert held <= lake.keys("targets", POOL)
        job(root)
        sweep(root, older_than_s=0)
        assert lake.damage() == []
        assert parts(root) == parts(undisturbed)


def parts(root: Path) -> dict[str, bytes]:
    """Content of all files but manifests, which name a part twice that was written again, and what was put aside."""
    return {
        name: content for name, content in files(root).items() if not name.endswith((".jsonl", ".damaged"))
    }
