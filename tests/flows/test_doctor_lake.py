"""`plancurate doctor --lake` and `plancurate sql` over a lake with damage."""

from __future__ import annotations

import shutil
from pathlib import Path

import pyarrow.parquet as pq
import pytest
import torch

from plancurate.flows.cli.app import main
from plancurate.tasks.lake.manifest import MANIFEST, append, entry_of, list_files
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.learning.policies import Normaliser, TrainedPolicy, make_policy

POOL = {"robot": "h2017", "scene": "free", "pool": "0a1b2c"}
RRT, PRM = ({**POOL, "planner": name} for name in ("RRT", "PRM"))


@pytest.fixture
def home(small_lake: Lake) -> Path:
    """A home with the small lake and a policy."""
    policy = make_policy("BC_MLP", {"hidden": (4,)})
    ones = [torch.ones(size) for size in (9, 9, 6, 6)]
    weights = policy.initial(9, 6, torch.Generator())
    folder = small_lake.root.parent / "models" / "BC_MLP-s0-0123"
    layout = (("target_offset", 3), ("joint_positions", 6))
    TrainedPolicy(policy, weights, Normaliser(*ones), layout, "delta", 10, 0).save(folder)
    return small_lake.root.parent


def said(capsys: pytest.CaptureFixture[str], home: Path, *words: str) -> tuple[int, list[str], list[str]]:
    """Run a command; returns its exit code and the lines of both outputs."""
    with pytest.raises(SystemExit) as stopped:
        main([*words, "--home", str(home)])
    spoken = capsys.readouterr()
    code = stopped.value.code
    return (code if isinstance(code, int) else 0), spoken.out.splitlines(), spoken.err.splitlines()


def test_a_sound_home_is_said_so_in_one_line(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, lines, errors = said(capsys, home, "doctor", "--lake")
    assert (code, errors) == (0, [])
    assert len(lines) == 1
    assert lines[0].startswith(f"{home}/lake: 17 parts, 1 policies, ")
    assert lines[0].endswith("nothing wrong")


def test_everything_that_is_wrong_is_named_in_a_line_of_its_own(
    home: Path, small_lake: Lake, capsys: pytest.CaptureFixture[str]
) -> None:
    rrt, prm = small_lake.folder("trajectories", RRT), small_lake.folder("trajectories", PRM)
    (rrt / "part-000000.parquet").write_bytes(b"changed")
    (rrt / "part-000001.parquet").unlink()
    shutil.copy(prm / "part-000000.parquet", rrt / "part-000009.parquet")
    footer = {"plancurate.schema_version": "99"}
    newer = prm / "part-000002.parquet"
    pq.write_table(pq.read_table(newer, partitioning=None).replace_schema_metadata(footer), newer)
    append(prm, entry_of(newer, newer.name))
    (home / "lake" / "targets" / "export.parquet").write_bytes(b"foreign")
    weights = home / "models" / "BC_MLP-s0-0123" / "policy.safetensors"
    weights.write_bytes(weights.read_bytes()[:-1] + b"\x01")
    code, lines, _ = said(capsys, home, "doctor", "--lake")
    assert code == 1
    for start in (
        f"{rrt}/part-000000.parquet: changed",
        f"{rrt}/part-000001.parquet: missing",
        f"{rrt}/part-000009.parquet: misplaced",
        f"{newer}: schema version 99",
        f"{home}/lake/targets/export.parquet: foreign",
        f"{weights}: changed",
    ):
        assert len([line for line in lines if line.startswith(start)]) == 1, (start, lines)
    assert len(lines) == 6


def test_an_audit_that_finds_rows_is_a_line(
    home: Path, small_lake: Lake, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = small_lake.folder("targets", POOL)
    (path,) = folder.glob("part-*.parquet")
    rows = pq.read_table(path, partitioning=None)
    moved = [x + 1.0 for x in rows["x"].to_pylist()]
    pq.write_table(rows.set_column(1, rows.schema.field("x"), [moved]), path)
    list_files(folder, [path.name])
    code, lines, _ = said(capsys, home, "doctor", "--lake")
    assert (code, len(lines)) == (1, 1)
    assert lines[0].startswith("sql/audits/assert_trajectories_lead_to_a_target.sql: 18 rows")


def test_sql_leaves_damaged_parts_out_and_says_so(
    home: Path, small_lake: Lake, capsys: pytest.CaptureFixture[str]
) -> None:
    (small_lake.folder("trajectories", RRT) / MANIFEST).unlink()
    code, lines, errors = said(
        capsys, home, "sql", "SELECT count(*) AS n FROM trajectories", "--format", "csv"
    )
    assert (code, lines) == (0, ['"n"', "9"])
    assert len(errors) == 3
    assert all(line.startswith("left out: ") and "foreign" in line for line in errors)
    code, lines, errors = said(capsys, home, "sql", "SELECT count(*) AS n FROM targets", "--format", "csv")
    assert (code, lines, errors) == (0, ['"n"', "3"], [])


def test_a_home_without_a_lake_is_a_mistake(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, _, errors = said(capsys, tmp_path / "nowhere", "doctor", "--lake")
    assert (code, len(errors)) == (2, 1)
    assert "no lake at" in errors[0]
    assert not (tmp_path / "nowhere").exists()


@pytest.mark.slow
def test_the_lakes_own_check_is_the_doctors(
    home: Path, small_lake: Lake, capsys: pytest.CaptureFixture[str]
) -> None:
    (small_lake.folder("trajectories", RRT) / "part-000000.parquet").write_bytes(b"changed")
    answer = said(capsys, home, "lake", "check")
    assert answer == said(capsys, home, "doctor", "--lake")
    assert answer[0] == 1


def test_the_status_names_tables_pools_and_studies(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, lines, _ = said(capsys, home, "lake", "status")
    assert code == 0
    assert ["trajectories", "6", "18"] in [line.split()[:3] for line in lines]
    assert ["0a1b2c", "h2017", "free", "3", "18"] in [line.split()[:5] for line in lines]
    assert lines[-1].endswith("none")


def test_gc_shows_first_and_drops_when_told(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    network = home / "models" / "BC_MLP-s0-0123"
    code, lines, _ = said(capsys, home, "lake", "gc")
    assert (code, lines) == (0, [f"{home}: nothing to drop"])
    code, lines, _ = said(capsys, home, "lake", "gc", "BC_MLP-s0-0123")
    assert lines[-1].endswith("--no-dry-run drops them")
    assert network.exists()
    code, lines, _ = said(capsys, home, "lake", "gc", "BC_MLP-s0-0123", "--no-dry-run")
    assert lines[0].startswith("network BC_MLP-s0-0123  0.00 MB  models/")
    assert lines[-1].startswith("1 dropped")
    assert not network.exists()
    code, _, errors = said(capsys, home, "lake", "gc", "--keep-days", "-1")
    assert code == 2
    assert len(errors) == 1
