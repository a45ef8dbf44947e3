"""A killed run goes on where it was: nothing twice, nothing torn."""

from __future__ import annotations

import shutil
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import pyarrow as pa

from plancurate import sql
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study.config import load_config

from ..homes import environment
from .commands import command_line
from .conftest import Command, Studied

TIMEOUT_S = 240


def kill_after_parts(words: list[str], home: Path, table: str, count: int, **variables: str) -> None:
    """Start a command and kill -9 it as soon as the lake holds `count` parts of a table with rows."""
    process = subprocess.Popen(
        command_line(*words),
        env=environment(**variables),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    deadline = time.monotonic() + TIMEOUT_S
    while sum("schema" not in path.name for path in (home / "lake" / table).rglob("part-*.parquet")) < count:
        assert process.poll() is None, "the command ended before it could be killed"
        assert time.monotonic() < deadline
        time.sleep(0.005)
    process.send_signal(signal.SIGKILL)
    process.wait()


def content(home: Path, statement: str) -> list[dict[str, Any]]:
    return list(Lake(home / "lake").sql(statement).to_pylist())


def test_a_killed_generate_goes_on_without_duplicates(
    smoke: Studied, plancurate: Command, shared_server: str, tmp_path: Path
) -> None:
    words = ["generate", "--preset", "smoke", "--home", str(tmp_path)]
    kill_after_parts(words, tmp_path, "trajectories", 3, PREFECT_API_URL=shared_server)
    assert plancurate(*words, PREFECT_API_URL=shared_server).returncode == 0
    planners = load_config("smoke", None, {}).planners
    same = (
        f"SELECT trajectory_id, q FROM trajectories WHERE target_id < 2 AND planner IN {planners} ORDER BY 1"
    )
    assert content(tmp_path, same) == content(smoke.untouched, same)
    assert_sound(tmp_path)


def test_a_killed_evaluate_goes_on_without_duplicates(
    smoke: Studied, plancurate: Command, shared_server: str, tmp_path: Path
) -> None:
    home = shutil.copytree(smoke.untouched, tmp_path / "home")
    shutil.rmtree(home / "lake" / "evaluations")
    words = ["study", "--preset", "smoke", "--home", str(home)]
    kill_after_parts(words, home, "evaluations", 2, PREFECT_API_URL=shared_server)
    done = plancurate(*words, PREFECT_API_URL=shared_server)
    assert done.returncode == 0, done.stderr
    same = (
        "SELECT * EXCLUDE (pool, selection_time_s, train_s) FROM evaluations ORDER BY evaluation_id, test_id"
    )
    assert content(home, same) == content(smoke.untouched, same)
    assert_sound(home)


def assert_sound(home: Path) -> None:
    lake = Lake(home / "lake")
    for name in sql.names("audits"):
        assert lake.query(name).num_rows == 0, name
    assert lake.damage() == []


def test_damage_in_any_table_is_made_again_and_said(
    smoke: Studied, plancurate_on_shared_server: Command, tmp_path: Path
) -> None:
    home = shutil.copytree(smoke.untouched, tmp_path / "home")
    (pool,) = content(home, "SELECT DISTINCT robot, scene, pool FROM targets")
    row = pa.table({"selection_id": ["CUPID-k2"], "split_half": [0.5]})
    Lake(home / "lake").write("rankings", pool, "CUPID-k2", row, {})  # no selector of the preset ranks
    lost = [
        next(path for path in sorted((home / "lake" / name).rglob("part-*.parquet")) if "=_" not in str(path))
        for name in ("targets", "trajectories", "studies", "selections", "rankings", "evaluations")
    ]
    lost.append(min((home / "models").glob("*/policy.safetensors")))
    for path in lost:
        path.write_bytes(path.read_bytes()[:-1])
    done = plancurate_on_shared_server("study", "--preset", "smoke", "--home", str(home))
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("made again:") == len(lost)
    assert all(str(path) in done.stderr for path in lost)
    same = "SELECT * EXCLUDE (selection_time_s, train_s) FROM evaluations ORDER BY evaluation_id, test_id"
    assert content(home, same) == content(smoke.untouched, same)
    assert_sound(home)
