from __future__ import annotations

import os
import re
import time
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.tasks.lake import Lake
from plancurate.tasks.lake.parts import read_footer
from plancurate.tasks.lake.schema import SCHEMA_VERSION, TABLES, table

POOL = {"robot": "h2017", "scene": "free", "pool": "0123"}
SCHEMA = table("targets").schema


def rows(*ids: int, x: float = 1.0) -> pa.Table:
    """Targets of these ids."""
    one = {"x": x, "y": 0.0, "z": 0.5, "goals": [[0.1, 0.2], [0.3, 0.4]]}
    return pa.Table.from_pylist([{"target_id": i, **one} for i in ids], SCHEMA)


@pytest.fixture
def lake(tmp_path: Path) -> Lake:
    return Lake(tmp_path / "lake")


@pytest.fixture
def part(lake: Lake) -> Path:
    """A sound part with targets 0 and 1."""
    return lake.write("targets", POOL, "a", rows(0, 1), {"seed": "3"})


def test_what_is_written_is_read_back_with_its_partition(lake: Lake, part: Path) -> None:
    assert part == lake.root / "targets/robot=h2017/scene=free/pool=0123/part-a.parquet"
    found = lake.read("targets", POOL)
    assert found.schema.equals(TABLES["targets"].full_schema)
    assert found.select(SCHEMA.names).to_pydict() == rows(0, 1).to_pydict()
    assert found["pool"].to_pylist() == ["0123", "0123"]  # a string, although it looks like a number


@pytest.mark.parametrize("name", TABLES)
def test_views_over_empty_tables_have_their_columns(lake: Lake, part: Path, name: str) -> None:
    everything = lake.read(name, {})
    assert everything.schema.equals(TABLES[name].full_schema)
    assert everything.num_rows == (2 if name == "targets" else 0)


def test_the_footer_says_how_the_part_came_to_be(lake: Lake, part: Path) -> None:
    footer = read_footer(part, table("targets"))
    assert footer == {"seed": "3", "key": "a", "schema_version": str(SCHEMA_VERSION)}


def test_writing_the_same_part_again_changes_nothing(lake: Lake, part: Path) -> None:
    before = (part.stat().st_ino, part.stat().st_mtime_ns, part.read_bytes())
    assert lake.write("targets", POOL, "a", rows(0, 1, x=9.0), {}) == part
    assert (part.stat().st_ino, part.stat().st_mtime_ns, part.read_bytes()) == before


def test_waypoints_are_stored_by_byte_streams_under_zstd(small_lake: Lake) -> None:
    path = next(small_lake.root.glob("trajectories/robot=h2017/*/*/*/part-*.parquet"))
    columns = {
        column.path_in_schema: column
        for column in (pq.ParquetFile(path).metadata.row_group(0).column(i) for i in range(36))
    }
    waypoints = columns["q.list.element.list.element"]
    assert waypoints.compression == "ZSTD"
    assert "BYTE_STREAM_SPLIT" in waypoints.encodings


def test_reading_can_be_cut_to_any_level(small_lake: Lake) -> None:
    assert small_lake.read("trajectories", {}).num_rows == 18
    assert small_lake.read("trajectories", {"planner": "PRM"}).num_rows == 9
    assert small_lake.read("trajectories", {"planner": "nobody"}).num_rows == 0
    with pytest.raises(ValueError, match="not by"):
        small_lake.read("trajectories", {"colour": "red"})


def test_columns_and_partitions_that_do_not_fit_are_refused(lake: Lake) -> None:
    with pytest.raises(ValueError, match=r"missing columns \['goals'\], unknown columns \[\]"):
        lake.write("targets", POOL, "a", rows(0).drop_columns(["goals"]), {})
    nulls = rows(0).set_column(1, "x", pa.array([None], pa.float64()))
    with pytest.raises(ValueError, match="column x must not hold nulls"):
        lake.write("targets", POOL, "a", nulls, {})
    with pytest.raises(ValueError, match="partitioned by"):
        lake.write("targets", {"robot": "h2017"}, "a", rows(0), {})
    with pytest.raises(UnknownNameError, match="did you mean targets"):
        lake.write("target", POOL, "a", rows(0), {})
    assert not list(lake.root.rglob("part-a.parquet"))


@pytest.mark.parametrize("value", ["", "..", "a/b", "my robot", "_", "ü", "a=b", "a*"])
def test_names_that_are_no_folder_names_are_one_line_errors(lake: Lake, value: str) -> None:
    with pytest.raises(PlancurateError, match=r"robot .* is no name for a folder"):
        lake.write("targets", {**POOL, "robot": value}, "a", rows(0), {})
    with pytest.raises(PlancurateError, match=r"key .* is no name for a folder"):
        lake.write("targets", POOL, value, rows(0), {})


def test_a_lake_that_is_not_there_is_said_so_and_not_made(tmp_path: Path) -> None:
    with pytest.raises(PlancurateError, match="no lake at"):
        Lake(tmp_path / "nowhere").query("results/studies")
    assert not (tmp_path / "nowhere").exists()


def corrupt(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-20])


def empty(path: Path) -> None:
    path.write_bytes(b"")


def foreign(path: Path) -> None:
    pq.write_table(pa.table({"a": [1]}), path)


def other_version(path: Path) -> None:
    footer = {"plancurate.schema_version": str(SCHEMA_VERSION + 1)}
    pq.write_table(rows(0).replace_schema_metadata(footer), path)


def other_column(path: Path) -> None:
    footer = {"plancurate.schema_version": str(SCHEMA_VERSION)}
    wrong = rows(0).set_column(1, "x", pa.array(["one"]))
    pq.write_table(wrong.replace_schema_metadata(footer), path)


def folder_in_place(path: Path) -> None:
    path.unlink()
    path.mkdir()


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (corrupt, "no readable Parquet file"),
        (empty, "no readable Parquet file"),
        (foreign, "not written by plancurate"),
        (other_version, f"schema version {SCHEMA_VERSION + 1}, but this plancurate reads version"),
        (other_column, "column x is string (may be null), the table targets has double"),
        (folder_in_place, "no readable Parquet file"),
    ],
)
def test_a_bad_part_is_named_with_what_is_wrong(lake: Lake, part: Path, damage, message: str) -> None:  # type: ignore[no-untyped-def]
    damage(part)
    for read in (
        lambda: lake.read("targets", POOL),
        lambda: lake.query("results/studies"),
        lambda: lake.sql("SELECT * FROM targets"),
        lake.check,
    ):
        with pytest.raises(PlancurateError, match=re.escape(message)) as caught:
            read()
        assert str(part) in str(caught.value)
        assert "\n" not in str(caught.value)


def test_damage_after_a_first_reading_is_found(lake: Lake, part: Path) -> None:
    lake.check()
    corrupt(part)
    with pytest.raises(PlancurateError, match=r"part-a\.parquet"):
        lake.read("targets", POOL)


def test_leftover_temporary_files_are_ignored_and_removed_when_old(lake: Lake, part: Path) -> None:
    fresh, old = (part.with_name(f".{part.name}.{name}.tmp") for name in ("fresh", "old"))
    for path in (fresh, old):
        path.write_bytes(b"half a file")
    os.utime(old, (time.time() - 7200,) * 2)
    assert lake.read("targets", POOL).num_rows == 2
    assert lake.keys("targets", POOL) == {"a"}
    assert lake.sweep() == [old]
    assert fresh.exists()
    assert not old.exists()


def test_foreign_files_beside_the_parts_do_not_matter(lake: Lake, part: Path) -> None:
    part.with_name("notes.parquet").write_text("not a part")
    (lake.root / "targets" / "README").write_text("not a part")
    assert lake.read("targets", POOL).num_rows == 2


def test_a_lake_may_lie_in_a_folder_with_odd_characters(tmp_path: Path) -> None:
    lake = Lake(tmp_path / "it's a [lake] with * and ?")
    lake.write("targets", POOL, "a", rows(0), {})
    assert lake.sql("SELECT target_id FROM targets").to_pydict() == {"target_id": [0]}


def test_the_same_row_in_two_parts_is_seen_once(lake: Lake, part: Path) -> None:
    lake.write("targets", POOL, "b", rows(1, 2), {})
    assert lake.read("targets", POOL)["target_id"].to_pylist() == [0, 1, 2]
