from __future__ import annotations

import os
import time
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.tasks.lake.compact import compact
from plancurate.tasks.lake.footer import read_footer
from plancurate.tasks.lake.parts import sweep
from plancurate.tasks.lake.schema import SCHEMA_VERSION, TABLES, table
from plancurate.tasks.lake.store import Lake

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


@pytest.mark.slow
@pytest.mark.parametrize("name", TABLES)
def test_views_over_empty_tables_have_their_columns(lake: Lake, part: Path, name: str) -> None:
    everything = lake.read(name, {})
    assert everything.schema.equals(TABLES[name].full_schema)
    assert everything.num_rows == (2 if name == "targets" else 0)


def test_the_footer_says_how_the_part_came_to_be(lake: Lake, part: Path) -> None:
    footer = read_footer(part, table("targets"))
    assert footer == {
        "seed": "3",
        "key": "a",
        "schema_version": str(SCHEMA_VERSION),
        "partition": "robot=h2017/scene=free/pool=0123",
    }


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


def test_a_key_is_located_among_the_partitions_that_match(lake: Lake, part: Path) -> None:
    other = {**POOL, "pool": "0124"}
    lake.write("targets", other, "b", rows(2), {})
    scene = {"robot": "h2017", "scene": "free"}
    assert lake.locate("targets", scene, "b") == other
    assert lake.locate("targets", {**scene, "study": "x"}, "a") == POOL
    assert lake.locate("targets", POOL, "b") is None
    assert lake.locate("targets", {"scene": "table"}, "a") is None
    for _ in range(2):
        lake.write("targets", other, "c", rows(3), {})
        compact(lake, "targets", other, {}, grace_s=0)
    assert lake.locate("targets", scene, "c") == other  # inside a merged part
    part.write_bytes(b"damaged")
    assert lake.locate("targets", scene, "a") is None


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


def test_leftover_temporary_files_are_ignored_and_removed_when_old(lake: Lake, part: Path) -> None:
    fresh, old = (part.with_name(f".{part.name}.{name}.tmp") for name in ("fresh", "old"))
    for path in (fresh, old):
        path.write_bytes(b"half a file")
    os.utime(old, (time.time() - 7200,) * 2)
    assert lake.read("targets", POOL).num_rows == 2
    assert lake.keys("targets", POOL) == {"a"}
    assert sweep(lake.root) == [old]
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
