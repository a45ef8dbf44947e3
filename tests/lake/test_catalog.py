from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import duckdb
import pytest

from plancurate.errors import PlancurateError
from plancurate.tasks.lake.catalog import write_catalog
from plancurate.tasks.lake.comments import COLUMNS
from plancurate.tasks.lake.schema import TABLES
from plancurate.tasks.lake.store import Lake

from ..lakes import copied


def count(catalog: Path, folder: Path) -> int:
    """Rows of trajectories by a process that works in another folder and knows nothing of plancurate."""
    program = "import duckdb, sys; print(duckdb.connect(sys.argv[1]).sql('FROM trajectories').shape[0])"
    done = subprocess.run(
        [sys.executable, "-c", program, str(catalog)],
        cwd=folder,
        env={"PATH": os.environ["PATH"]},
        capture_output=True,
        text=True,
        check=True,
    )
    return int(done.stdout)


@pytest.fixture(scope="module")
def catalog(small_lake_once: Lake, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The catalog of the small lake, for tests that read what it defines."""
    return write_catalog(copied(small_lake_once, tmp_path_factory.mktemp("catalog")).root)


@pytest.mark.slow
def test_the_catalog_opens_the_lake_from_any_folder(small_lake: Lake, tmp_path: Path) -> None:
    catalog = write_catalog(small_lake.root)
    assert catalog == small_lake.root / "catalog.duckdb"
    assert count(catalog, tmp_path) == count(catalog, Path("/")) == 18
    assert catalog.stat().st_size < 2**21  # definitions only


def test_the_catalog_shows_the_folder_as_it_is_now(small_lake: Lake) -> None:
    catalog = write_catalog(small_lake.root)
    shutil.rmtree(
        small_lake.root / "trajectories" / "robot=h2017" / "scene=free" / "pool=0a1b2c" / "planner=RRT"
    )
    with duckdb.connect(str(catalog), read_only=True) as connection:
        assert connection.sql("FROM trajectories").count("*").fetchall() == [(9,)]
        assert connection.sql("FROM evaluations").fetchall() == []


def test_the_catalog_can_be_attached_beside_other_databases(small_lake: Lake) -> None:
    catalog = write_catalog(small_lake.root)
    with duckdb.connect() as connection:
        connection.execute(f"ATTACH '{catalog}' AS lake (READ_ONLY)")
        with pytest.raises(duckdb.Error, match="SET VARIABLE lake_folder"):
            connection.sql("FROM lake.trajectories")
        connection.execute(f"SET VARIABLE lake_folder = '{small_lake.root}'")
        rows = connection.sql(
            "SELECT joint_movement, lake.joint_movement(q) FROM lake.trajectories WHERE solved"
        )
        assert all(stored == pytest.approx(again, abs=1e-6) for stored, again in rows.fetchall())


@pytest.mark.slow
def test_a_copied_catalog_answers_from_the_copy_even_when_the_original_is_gone(
    small_lake: Lake, tmp_path: Path
) -> None:
    write_catalog(small_lake.root)
    copy = tmp_path / "it's a [copy] *" / "lake"
    shutil.copytree(small_lake.root, copy)
    shutil.rmtree(copy / "trajectories" / "robot=h2017" / "scene=free" / "pool=0a1b2c" / "planner=RRT")
    assert count(copy / "catalog.duckdb", small_lake.root) == 9
    assert count(Path("lake/catalog.duckdb"), copy.parent) == 9
    assert count(Path("catalog.duckdb"), copy) == 9
    shutil.rmtree(small_lake.root)
    assert count(copy / "catalog.duckdb", Path("/")) == 9
    shutil.rmtree(copy / "trajectories")
    with pytest.raises(subprocess.CalledProcessError) as failed:
        count(copy / "catalog.duckdb", Path("/"))
    assert "No files found" in failed.value.stderr


@pytest.mark.slow
def test_a_catalog_attached_to_another_ones_session_is_refused(small_lake: Lake, tmp_path: Path) -> None:
    catalog = write_catalog(small_lake.root)
    shutil.copytree(small_lake.root, tmp_path / "copy")
    with duckdb.connect(str(catalog), read_only=True) as connection:
        connection.execute(f"ATTACH '{tmp_path}/copy/catalog.duckdb' AS copied (READ_ONLY)")
        for name in TABLES:
            with pytest.raises(
                duckdb.Error, match=f"{tmp_path}/copy/catalog.duckdb would answer from {catalog.parent}"
            ):
                connection.sql(f"FROM copied.{name}").fetchall()


@pytest.mark.slow
def test_a_session_that_spills_elsewhere_is_told_what_to_say(small_lake: Lake, tmp_path: Path) -> None:
    catalog = write_catalog(small_lake.root)
    with duckdb.connect(str(catalog), read_only=True, config={"temp_directory": str(tmp_path)}) as connection:
        with pytest.raises(duckdb.Error, match="SET VARIABLE lake_folder"):
            connection.sql("FROM trajectories")
        connection.execute(f"SET VARIABLE lake_folder = '{small_lake.root}'")
        assert connection.sql("FROM trajectories").shape[0] == 18


@pytest.mark.slow
def test_the_catalog_holds_no_path_and_is_written_once(small_lake: Lake, tmp_path: Path) -> None:
    catalog = write_catalog(small_lake.root)
    before = catalog.stat().st_mtime_ns
    assert write_catalog(small_lake.root).stat().st_mtime_ns == before
    assert str(small_lake.root).encode() not in catalog.read_bytes()
    moved = small_lake.root.rename(tmp_path / "moved")
    assert write_catalog(moved).stat().st_mtime_ns == before
    assert count(moved / "catalog.duckdb", Path("/")) == 18


@pytest.mark.slow
def test_a_damaged_catalog_is_replaced(small_lake: Lake) -> None:
    (small_lake.root / "catalog.duckdb").write_bytes(b"not a database")
    assert count(write_catalog(small_lake.root), Path("/")) == 18
    assert not list(small_lake.root.glob(".*.tmp"))


@pytest.mark.parametrize(
    "statement",
    [
        "SELECT count(*) FROM trajectories",
        "FROM targets -- a comment",
        "SELECT 1 AS a;",
        "DESCRIBE trajectories",
        "SUMMARIZE targets",
        "SHOW TABLES",
        "WITH t AS (SELECT * FROM targets) SELECT max(x) FROM t",
        "PIVOT trajectories ON planner USING count(*) GROUP BY target_id",
    ],
)
def test_a_user_may_ask_anything(small_lake: Lake, statement: str) -> None:
    assert small_lake.sql(statement).num_rows > 0


def test_a_users_rows_come_in_the_order_asked_for(small_lake: Lake) -> None:
    rows = small_lake.sql("SELECT target_id, planner, run FROM trajectories ORDER BY run DESC, target_id")
    assert rows["run"].to_pylist() == sorted(rows["run"].to_pylist(), reverse=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("statement", "message"),
    [
        ("SELEC 1", "syntax error"),
        ("SELECT nothing FROM targets", "nothing"),
        ("", "exactly one SELECT"),
        ("SELECT 1; SELECT 2", "exactly one SELECT"),
        ("CREATE TABLE t (a INT)", "exactly one SELECT"),
        ("COPY (SELECT 1) TO '{lake}/x.csv'", "exactly one SELECT"),
        ("EXPLAIN ANALYZE COPY (SELECT 1) TO '{lake}/x.csv'", "exactly one SELECT"),
        ("EXPORT DATABASE '{lake}/x'", "exactly one SELECT"),
        ("SET enable_external_access = true", "exactly one SELECT"),
        ("ATTACH '{lake}/x.duckdb'", "exactly one SELECT"),
        ("INSTALL httpfs", "exactly one SELECT"),
        ("WITH x AS (COPY (SELECT 1) TO '{lake}/x.csv') SELECT 1", "top level"),
        ("WITH y AS (WITH x AS (COPY (SELECT 1) TO '{lake}/x.csv') FROM x) FROM y", "top level"),
        ("SELECT 1) UNION ALL (WITH x AS (COPY (SELECT 1) TO '{lake}/x.csv') SELECT 1", "syntax error"),
        ("FROM read_text('/etc/passwd')", "Permission"),
        ("FROM read_text('{lake}/../secret')", "Permission"),
        ("FROM glob('/etc/*')", "Permission"),
        ("FROM 'https://localhost/x.parquet'", "."),
    ],
)
def test_a_user_can_neither_write_nor_leave_the_lake(small_lake: Lake, statement: str, message: str) -> None:
    (small_lake.root.parent / "secret").write_text("secret")
    before = sorted(small_lake.root.rglob("*"))
    with pytest.raises(PlancurateError, match=message) as caught:
        small_lake.sql(statement.format(lake=small_lake.root))
    assert "\n" not in str(caught.value)
    assert sorted(small_lake.root.rglob("*")) == before


@pytest.mark.slow
@pytest.mark.parametrize("name", TABLES)
@pytest.mark.parametrize("rest", ["", " ORDER BY 1 LIMIT 5"])
def test_a_look_through_the_catalog_lists_the_folder_once(catalog: Path, name: str, rest: str) -> None:
    # DuckDB may turn one reading of a view into two scans that list the folder one after the other; a part
    # that is removed in between would be missed.
    with duckdb.connect(str(catalog), read_only=True) as connection:
        plan = connection.execute(f"EXPLAIN SELECT * FROM {name}{rest}").fetchall()[0][1]
    assert plan.count("READ_PARQUET") == 1


def test_every_view_and_column_is_explained_to_whoever_opens_the_catalog(catalog: Path) -> None:
    with duckdb.connect(str(catalog), read_only=True) as connection:
        views = dict(
            connection.sql("SELECT view_name, comment FROM duckdb_views() WHERE NOT internal").fetchall()
        )
        columns = {
            (view, column): comment
            for view, column, comment in connection.sql(
                "SELECT table_name, column_name, comment FROM duckdb_columns() WHERE NOT internal"
            ).fetchall()
        }
    assert set(views) == {*TABLES, "waypoints", "results"}
    assert all(said.startswith("One row a") for said in views.values())
    assert {view for view, _ in columns} == set(views)
    assert [column for column, comment in columns.items() if not comment] == []
    assert columns["trajectories", "plan_s"].endswith(", s")
    assert columns["evaluations", "steps"] != columns["selections", "steps"]


def test_nothing_is_explained_that_is_not_there(catalog: Path) -> None:
    with duckdb.connect(str(catalog), read_only=True) as connection:
        rows = connection.sql(
            "SELECT table_name, column_name FROM duckdb_columns() WHERE NOT internal"
        ).fetchall()
    known = {column for _, column in rows} | {f"{view}.{column}" for view, column in rows}
    assert set(COLUMNS) <= known


@pytest.mark.parametrize("unit", ["m", "rad", "s", "cm"])
def test_columns_whose_name_ends_in_a_unit_say_it(unit: str) -> None:
    named = {name: said for name, said in COLUMNS.items() if name.endswith(f"_{unit}")}
    assert all(re.search(rf"\b{unit}\b", said) for said in named.values())
