"""A killed run goes on where it was: nothing twice, nothing torn."""

from __future__ import annotations

import os
import shutil
import signal
import time
from pathlib import Path
from typing import Any

import pyarrow as pa

from plancurate import sql
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study.config import load_config

from .commands import Commands, Running
from .conftest import Command, Studied

TIMEOUT_S = 240


def kill_after_parts(running: Running, home: Path, table: str, count: int) -> None:
    """kill -9 a command as soon as the lake holds `count` parts of a table with rows."""
    deadline = time.monotonic() + TIMEOUT_S
    while sum("schema" not in path.name for path in (home / "lake" / table).rglob("part-*.parquet")) < count:
        assert not running.has_ended(), "the command ended before it could be killed"
        assert time.monotonic() < deadline
        time.sleep(0.005)
    os.kill(running.pid, signal.SIGKILL)
    assert running.result().returncode == -signal.SIGKILL


def content(home: Path, statement: str) -> list[dict[str, Any]]:
    return list(Lake(home / "lake").sql(statement).to_pylist())


def test_a_killed_generate_goes_on_without_duplicates(
    smoke: Studied, commands: Commands, shared_server: str, tmp_path: Path
) -> None:
    words = ("generate", "--preset", "smoke", "--home", str(tmp_path))
    started = commands.start(*words, PREFECT_API_URL=shared_server)
    kill_after_parts(started, tmp_path, "trajectories", 3)
    assert commands.run(*words, PREFECT_API_URL=shared_server).returncode == 0
    planners = load_config("smoke", None, {}).planners
    same = (
        f"SELECT trajectory_id, q FROM trajectories WHERE target_id < 2 AND planner IN {planners} ORDER BY 1"
    )
    assert content(tmp_path, same) == content(smoke.untouched, same)
    assert_sound(tmp_path)


def test_a_killed_evaluate_goes_on_without_duplicates(
    smoke: Studied, commands: Commands, shared_server: str, tmp_path: Path
) -> None:
    home = shutil.copytree(smoke.untouched, tmp_path / "home")
    shutil.rmtree(home / "lake" / "evaluations")
    words = ("study", "--preset", "smoke", "--home", str(home))
    kill_after_parts(commands.start(*words, PREFECT_API_URL=shared_server), home, "evaluations", 2)
    done = commands.run(*words, PREFECT_API_URL=shared_server)
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
