"""What is not as it was written is named and never read; what is sound beside it still is."""

from __future__ import annotations

import os
import random
import shutil
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import duckdb
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from plancurate.errors import PlancurateError
from plancurate.tasks.lake import parts
from plancurate.tasks.lake.compact import compact
from plancurate.tasks.lake.footer import OWN
from plancurate.tasks.lake.manifest import MANIFEST, append, entry_of, locked
from plancurate.tasks.lake.mend import mend
from plancurate.tasks.lake.schema import SCHEMA_VERSION, table
from plancurate.tasks.lake.store import Lake

POOL = {"robot": "h2017", "scene": "free", "pool": "0123"}
OTHER = {**POOL, "pool": "0124"}
SCHEMA = table("targets").schema
EVERYTHING = "SELECT target_id FROM targets ORDER BY target_id"


def rows(*ids: int) -> pa.Table:
    """Targets of these ids."""
    one = {"x": 1.0, "y": 0.0, "z": 0.5, "goals": [[0.1, 0.2], [0.3, 0.4]]}
    return pa.Table.from_pylist([{"target_id": i, **one} for i in ids], SCHEMA)


@pytest.fixture
def lake(tmp_path: Path) -> Lake:
    """Targets 0 and 1 in a pool, 2 in another one."""
    lake = Lake(tmp_path / "lake")
    lake.write("targets", POOL, "a", rows(0, 1), {})
    lake.write("targets", OTHER, "b", rows(2), {})
    return lake


@pytest.fixture
def part(lake: Lake) -> Path:
    """The part of the first pool."""
    return lake.folder("targets", POOL) / "part-a.parquet"


def flip(path: Path, position: int, bit: int) -> None:
    """Change one bit of a file and leave its size and time as they are."""
    status = path.stat()
    content = bytearray(path.read_bytes())
    content[position] ^= 1 << bit
    path.write_bytes(content)
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))


def changed(part: Path) -> None:
    flip(part, part.stat().st_size // 2, 3)


def torn(part: Path) -> None:
    part.write_bytes(part.read_bytes()[:-20])


def empty(part: Path) -> None:
    part.write_bytes(b"")


def folder(part: Path) -> None:
    part.unlink()
    part.mkdir()


def missing(part: Path) -> None:
    part.unlink()


def newer(part: Path) -> None:
    part.unlink()
    footer = {f"{OWN}schema_version": str(SCHEMA_VERSION + 1)}
    pq.write_table(rows(0).replace_schema_metadata(footer), part)
    append(part.parent, entry_of(part, part.name, 1))


def newer_without_entry(part: Path) -> None:
    newer(part)
    (part.parent / MANIFEST).unlink()


def foreign(part: Path) -> None:
    (part.parent / MANIFEST).unlink()
    pq.write_table(pa.table({"a": [1]}), part)


def unlisted(part: Path) -> None:
    (part.parent / MANIFEST).unlink()


def other_column(part: Path) -> None:
    footer = {f"{OWN}schema_version": str(SCHEMA_VERSION)}
    wrong = rows(0).set_column(1, "x", pa.array(["one"]))
    pq.write_table(wrong.replace_schema_metadata(footer), part)
    append(part.parent, entry_of(part, part.name, 1))


def misplaced(part: Path) -> None:
    """The whole other partition, manifest and all, under this one's name."""
    shutil.rmtree(part.parent)
    shutil.copytree(part.parent.with_name("pool=0124"), part.parent)
    (part.parent / "part-b.parquet").rename(part)
    append(part.parent, entry_of(part, part.name, 1))


def moved_in(part: Path) -> None:
    """A part of the other partition over this one, without an entry of its own."""
    (part.parent / MANIFEST).unlink()
    shutil.copy(part.parent.with_name("pool=0124") / "part-b.parquet", part)


DAMAGES: list[tuple[Callable[[Path], None], str]] = [
    (changed, "changed since it was written, its SHA-256 is not the one in manifest.jsonl"),
    (torn, "changed since it was written, it has "),
    (empty, "changed since it was written, it has 0 bytes"),
    (folder, "changed since it was written, it is no file"),
    (missing, "missing, although manifest.jsonl names it"),
    (newer, f"schema version {SCHEMA_VERSION + 1}, but this plancurate reads version {SCHEMA_VERSION}"),
    (newer_without_entry, f"schema version {SCHEMA_VERSION + 1}, but"),
    (foreign, "foreign, not written by plancurate"),
    (unlisted, "foreign, manifest.jsonl does not name it"),
    (other_column, "column x is string (may be null), the table targets has double"),
    (misplaced, "misplaced, its rows belong to robot=h2017/scene=free/pool=0124"),
    (moved_in, "misplaced, its rows belong to robot=h2017/scene=free/pool=0124"),
]
each_damage = pytest.mark.parametrize(("damage", "message"), DAMAGES, ids=[d.__name__ for d, _ in DAMAGES])


@each_damage
def test_a_damaged_part_is_named_and_not_read(
    lake: Lake, part: Path, damage: Callable[[Path], None], message: str
) -> None:
    damage(part)
    again = Lake(lake.root)
    for read in (
        lambda: again.read("targets", POOL),
        lambda: again.query("pool/targets", targets=None, **POOL),
        lambda: again.connect(POOL),
        again.connect,
    ):
        with pytest.raises(PlancurateError) as caught:
            read()
        assert f"{part}: {message}" in str(caught.value)
        assert "\n" not in str(caught.value)
    assert f"{part}: {message}" in "\n".join(problem.line for problem in again.damage())


@pytest.mark.slow
@each_damage
def test_damage_in_one_pool_stops_nothing_of_another(
    lake: Lake, part: Path, damage: Callable[[Path], None], message: str
) -> None:
    damage(part)
    again = Lake(lake.root)
    assert again.read("targets", OTHER)["target_id"].to_pylist() == [2]
    assert again.query("pool/targets", targets=None, **OTHER)["target_id"].to_pylist() == [2]
    assert again.read("trajectories", {}).num_rows == 0
    with again.connect(OTHER) as connection:
        assert connection.sql(EVERYTHING).fetchall() == [(2,)]
    lines: list[str] = []
    assert again.sql(EVERYTHING, lines.append)["target_id"].to_pylist() == [2]
    assert len([line for line in lines if line.startswith(f"left out: {part}: {message}")]) == 1
    assert again.sql("SELECT count(*) AS n FROM trajectories", pytest.fail)["n"].to_pylist() == [0]


def test_a_user_who_says_nothing_of_it_is_warned(lake: Lake, part: Path) -> None:
    changed(part)
    with pytest.warns(UserWarning, match=r"left out: .*part-a\.parquet: changed"):
        Lake(lake.root).sql(EVERYTHING)


@pytest.mark.slow
def test_a_flipped_bit_never_gives_other_values(small_lake: Lake) -> None:
    partition = {"robot": "h2017", "scene": "free", "pool": "0a1b2c", "planner": "RRT"}
    part = small_lake.folder("trajectories", partition) / "part-000000.parquet"
    whole, chance = part.read_bytes(), random.Random(1)
    for position in chance.sample(range(len(whole)), 60):
        flip(part, position, chance.randrange(8))
        again = Lake(small_lake.root)
        with pytest.raises(PlancurateError, match=r"part-000000\.parquet: changed since it was written"):
            again.query("pool/candidates", targets=None, planners=None, **dict(list(partition.items())[:3]))
        assert [problem.path for problem in again.damage()] == [part]
        part.write_bytes(whole)
    assert Lake(small_lake.root).damage() == []


def test_pages_carry_checksums_for_those_who_read_parts_without_us(small_lake: Lake) -> None:
    path = next(small_lake.root.glob("trajectories/robot=h2017/*/*/planner=RRT/part-000000.parquet"))
    metadata = pq.read_metadata(path).row_group(0)
    column = next(
        metadata.column(i)
        for i in range(metadata.num_columns)
        if metadata.column(i).path_in_schema == "q.list.element.list.element"
    )
    flip(path, column.data_page_offset + column.total_compressed_size - 5, 0)
    with pytest.raises(OSError, match=r"(?i)crc|checksum"):
        pq.read_table(path, partitioning=None, page_checksum_verification=True)


def test_damage_after_a_first_reading_is_found(lake: Lake, part: Path) -> None:
    assert lake.damage() == []
    torn(part)
    with pytest.raises(PlancurateError, match=r"part-a\.parquet"):
        lake.read("targets", POOL)


def test_several_damages_are_counted_in_the_one_line(lake: Lake, part: Path) -> None:
    lake.write("targets", POOL, "c", rows(3), {})
    for path in part.parent.glob("part-*.parquet"):
        torn(path)
    with pytest.raises(PlancurateError, match=r"part-a.*\(1 more: `plancurate doctor --lake` names all\)"):
        lake.read("targets", POOL)


@pytest.mark.parametrize(
    ("spot", "left"), [(b"{", {"c"}), (b"\n", set()), (None, set())], ids=["a line", "its end", "all of it"]
)
def test_a_damaged_manifest_is_never_taken_for_a_sound_one(
    lake: Lake, part: Path, spot: bytes | None, left: set[str]
) -> None:
    lake.write("targets", POOL, "c", rows(3), {})
    path = part.parent / MANIFEST
    if spot is None:
        path.unlink()
    else:
        flip(path, path.read_bytes().index(spot), 0)
    with pytest.raises(PlancurateError, match=str(part.parent)):
        Lake(lake.root).read("targets", POOL)
    assert mend(lake, "targets", POOL)
    assert lake.keys("targets", POOL) == left
    assert lake.damage() == []


def test_a_writer_killed_before_its_part_appears_leaves_a_missing_one_that_can_be_written_again(
    lake: Lake, part: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def kill(temporary: Path, path: Path) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as killed:
        killed.setattr(parts, "publish", kill)
        with pytest.raises(KeyboardInterrupt):
            lake.write("targets", POOL, "c", rows(3), {})
    assert [(problem.path.name, problem.kind) for problem in lake.damage()] == [("part-c.parquet", "missing")]
    lake.write("targets", POOL, "c", rows(3), {})
    assert lake.damage() == []
    assert lake.read("targets", POOL)["target_id"].to_pylist() == [0, 1, 3]


@pytest.mark.slow
def test_a_part_on_its_way_in_is_waited_for(lake: Lake, part: Path) -> None:
    aside = part.rename(part.with_name(".aside"))
    with ThreadPoolExecutor() as pool, locked(part.parent):
        reading = pool.submit(Lake(lake.root).read, "targets", POOL)
        with pytest.raises(TimeoutError):
            reading.result(timeout=0.5)
        aside.rename(part)
    assert reading.result(timeout=30).num_rows == 2


def test_files_that_are_no_parts_are_named_but_do_not_matter(lake: Lake, part: Path) -> None:
    notes = part.with_name("notes.parquet")
    shutil.copy(part, notes)
    lost = lake.root / "targets" / "part-a.parquet"
    shutil.copy(part, lost)
    (lake.root / "targets" / "README").write_text("not a part")
    assert lake.read("targets", {}).num_rows == 3
    assert {problem.path for problem in lake.damage()} == {notes, lost}
    assert {problem.kind for problem in lake.damage()} == {"foreign"}


@each_damage
def test_a_mended_partition_can_be_filled_again(
    lake: Lake, part: Path, damage: Callable[[Path], None], message: str
) -> None:
    damage(part)
    again = Lake(lake.root)
    if damage in (newer, newer_without_entry):
        with pytest.raises(PlancurateError, match="schema version"):
            mend(again, "targets", POOL)
        assert part.exists()
        return
    there = part.exists()
    assert part in {problem.path for problem in mend(again, "targets", {"robot": "h2017"})}
    assert not part.exists()
    aside = list(part.parent.glob(".part-a.parquet.*.damaged"))
    assert len(aside) == there
    assert "a" not in again.keys("targets", POOL)
    again.write("targets", POOL, "a", rows(0, 1), {})
    assert again.read("targets", {})["target_id"].to_pylist() == [0, 1, 2]
    assert again.damage() == []
    assert mend(again, "targets", {}) == []


def test_a_damaged_merged_part_gives_way_to_the_parts_that_are_still_there(lake: Lake, part: Path) -> None:
    lake.write("targets", POOL, "c", rows(3), {})
    before = lake.read("targets", POOL)
    compact(lake, "targets", POOL, {}, grace_s=600)
    merged = next(part.parent.glob("part-merged*"))
    torn(merged)
    assert [problem.path for problem in mend(lake, "targets", POOL)] == [merged]
    assert lake.read("targets", POOL).equals(before)


def test_a_tool_of_ones_own_does_not_see_what_was_moved_aside(lake: Lake, part: Path) -> None:
    torn(part)
    mend(lake, "targets", POOL)
    found = duckdb.sql(f"FROM read_parquet('{lake.root}/targets/**/*.parquet')")
    assert found.shape[0] == 1
