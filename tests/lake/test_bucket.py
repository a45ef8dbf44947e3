"""A lake in a bucket: what one machine writes all others read, the first writer's part stays, nothing is lost.

The store lives in memory here; tests/services has one that is asked over HTTP.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pyarrow as pa
import pytest
from obstore.store import MemoryStore

from plancurate.errors import PlancurateError
from plancurate.tasks.lake import bucket
from plancurate.tasks.lake.bucket import VARIABLE, Bucket
from plancurate.tasks.lake.compact import compact
from plancurate.tasks.lake.home import Home
from plancurate.tasks.lake.manifest import folder_damage, list_files
from plancurate.tasks.lake.mend import mend
from plancurate.tasks.lake.retention import drop, unreferred
from plancurate.tasks.lake.schema import table
from plancurate.tasks.lake.store import Lake

from ..lakes import POOL

URL = "s3://bucket/prefix"
OTHER = {**POOL, "pool": "0f0f0f"}

Machine = Callable[[str], Lake]


@pytest.fixture
def store(monkeypatch: pytest.MonkeyPatch) -> MemoryStore:
    """The store behind the address that the environment names."""
    store = MemoryStore()
    monkeypatch.setattr(bucket, "_store", lambda _url: store)
    monkeypatch.setenv(VARIABLE, URL)
    return store


@pytest.fixture
def machine(store: MemoryStore, tmp_path: Path) -> Machine:
    """The lake as a machine of that name sees it."""
    return lambda name: Lake(tmp_path / name / "lake")


def target(number: int, x: float = 0.5) -> pa.Table:
    row = {"target_id": number, "x": x, "y": 0.0, "z": 0.5, "goals": [[0.1, 0.2]]}
    return pa.Table.from_pylist([row], table("targets").schema)


def fill(lake: Lake, numbers: range = range(3)) -> None:
    for number in numbers:
        lake.write("targets", POOL, f"{number:03d}", target(number), {})


def keys(store: MemoryStore) -> list[str]:
    return [item["path"] for found in store.list() for item in found]


def test_what_one_machine_writes_another_reads(machine: Machine) -> None:
    one, other = machine("one"), machine("other")
    fill(one)
    assert other.keys("targets", POOL) == {"000", "001", "002"}
    assert other.read("targets", {}).equals(one.read("targets", {}))
    assert other.damage() == []


def test_only_what_is_asked_for_is_copied(machine: Machine) -> None:
    one, other = machine("one"), machine("other")
    fill(one)
    one.write("targets", OTHER, "000", target(0), {})
    assert other.read("targets", {"pool": OTHER["pool"]}).num_rows == 1
    assert not other.folder("targets", POOL).exists()


def test_of_two_writers_at_once_the_first_ones_part_stays_for_both(machine: Machine) -> None:
    one, other = machine("one"), machine("other")
    assert other.keys("targets", POOL) == set()
    fill(one, range(1))
    other.keys = lambda *_: set()  # type: ignore[method-assign]  # it looked before the first part was there
    other.write("targets", POOL, "000", target(0, x=0.7), {})
    assert other.read("targets", POOL)["x"].to_pylist() == [0.5]
    assert machine("third").read("targets", POOL)["x"].to_pylist() == [0.5]


def test_a_machine_that_loses_its_copy_has_lost_nothing(machine: Machine) -> None:
    lake = machine("one")
    fill(lake)
    part = next(lake.folder("targets", POOL).glob("part-*"))
    part.unlink()
    assert lake.read("targets", POOL).num_rows == 3
    part.write_bytes(part.read_bytes()[:-1] + b"?")
    assert [damage.kind for damage in lake.damage()] == ["changed"]
    mend(lake, "targets", POOL)
    assert lake.read("targets", POOL).num_rows == 3
    assert lake.damage() == []


def test_a_changed_byte_in_the_bucket_is_named_and_not_read(machine: Machine, store: MemoryStore) -> None:
    fill(machine("one"))
    key = keys(store)[0]
    found = store.get(key)
    content = bytes(found.bytes())
    store.put(key, content[:-1] + b"?", attributes=found.attributes)
    with pytest.raises(PlancurateError, match=f"{URL}/{key}: changed since it was written"):
        machine("other").read("targets", POOL)


def test_merged_parts_leave_the_bucket_and_every_copy(machine: Machine, store: MemoryStore) -> None:
    one, other = machine("one"), machine("other")
    fill(one)
    before = other.read("targets", POOL)
    assert [compact(one, "targets", POOL, {}, grace_s=0) for _ in range(2)] == [0, 3]
    assert len(keys(store)) == 1
    assert other.read("targets", POOL).equals(before)
    assert other.keys("targets", POOL) == {"000", "001", "002"}
    assert len(list(other.folder("targets", POOL).glob("part-*"))) == 1
    assert other.damage() == []


def test_what_is_dropped_leaves_the_bucket_and_every_copy(machine: Machine, store: MemoryStore) -> None:
    one, other = machine("one"), machine("other")
    fill(one)
    assert other.read("targets", {}).num_rows == 3
    home = Home(one.root.parent)
    home.locks.mkdir()
    network = home.models / "BC_MLP-s0"
    network.mkdir(parents=True)
    bucket_of(one).put_network(network, network)
    assert len(keys(store)) == 4
    drop(home, unreferred(home, keep_days=0))
    assert keys(store) == []
    assert other.read("targets", {}).num_rows == one.read("targets", {}).num_rows == 0


def test_a_network_travels_whole(machine: Machine, tmp_path: Path) -> None:
    trained, copied = tmp_path / "trained", tmp_path / "models" / "network"
    trained.mkdir()
    (trained / "weights").write_bytes(b"1234")
    list_files(trained, ["weights"])
    there = bucket_of(machine("one"))
    bucket_of(machine("other")).pull_network(copied)
    assert not copied.exists()
    there.put_network(copied, trained)
    (trained / "weights").write_bytes(b"5678")
    there.put_network(copied, trained)
    for _ in range(2):
        bucket_of(machine("other")).pull_network(copied)
        assert (copied / "weights").read_bytes() == b"1234"
        assert folder_damage(copied) == []
    assert [path.name for path in copied.parent.iterdir()] == ["network"]


def bucket_of(lake: Lake) -> Bucket:
    assert lake.bucket is not None
    return lake.bucket


def test_a_copy_stays_one_without_the_variable(machine: Machine, monkeypatch: pytest.MonkeyPatch) -> None:
    fill(machine("one"))
    assert machine("other").keys("targets", POOL)
    monkeypatch.delenv(VARIABLE)
    fill(machine("other"), range(3, 4))
    assert len(machine("one").keys("targets", POOL)) == 4


def test_what_a_folder_can_not_be_a_copy_of(machine: Machine, monkeypatch: pytest.MonkeyPatch) -> None:
    fill(machine("one"))
    monkeypatch.setenv(VARIABLE, "s3://bucket/elsewhere")
    with pytest.raises(PlancurateError, match=f"is a copy of {URL}; another home folder"):
        machine("one")
    monkeypatch.delenv(VARIABLE)
    fill(machine("own"))
    monkeypatch.setenv(VARIABLE, URL)
    with pytest.raises(PlancurateError, match="holds a lake of its own; another home folder"):
        machine("own")
    monkeypatch.setenv(VARIABLE, "bucket")
    with pytest.raises(PlancurateError, match="PLANCURATE_LAKE=bucket: s3://BUCKET or"):
        machine("new")
