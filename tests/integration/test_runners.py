"""A study gives the same rows wherever its task runs work, and whoever works beside it."""

from __future__ import annotations

from pathlib import Path

import pytest

from plancurate.tasks.lake.store import Lake

from ..homes import NewHome
from .commands import Commands
from .conftest import Command
from .test_resume import assert_sound

TINY = """
n_targets: 2
planners: [RRTConnect, PRM]
candidates: {plan: {runs: 1}}
selectors: [General, KMeans_Hybrid]
budgets: [1]
policies: [BC_MLP, BC_RNN]
training: {steps: 20}
"""
# Everything but what was measured, and the study's name.
ROWS = (
    "SELECT * EXCLUDE (plan_s, timing_s, verify_s) FROM trajectories ORDER BY trajectory_id",
    "SELECT replace(study, '{name}-', '') AS key, selection_id, trajectory_id, rank, score FROM selections "
    "WHERE starts_with(study, '{name}-') ORDER BY ALL",
    "SELECT * EXCLUDE (study, selection_time_s, train_s) FROM evaluations WHERE starts_with(study, '{name}-') "
    "ORDER BY evaluation_id, kind, test_id",
)

Rows = list[list[dict[str, object]]]


def words(home: Path, name: str, runner: str) -> list[str]:
    """Return the command of the tiny study of that name."""
    file = home / f"{runner}.yaml"
    file.write_text(f"{TINY}runner: {runner}\n")
    return ["study", "--config", str(file), "--name", name, "--home", str(home)]


def rows(home: Path, name: str) -> Rows:
    """Return what the study of that name wrote."""
    return [Lake(home / "lake").sql(query.format(name=name)).to_pylist() for query in ROWS]


def rows_of_a_run(plancurate: Command, home: Path, runner: str) -> Rows:
    """Run the tiny study in a home of its own and return what it wrote."""
    done = plancurate(*words(home, "tiny", runner))
    assert done.returncode == 0, done.stderr
    return rows(home, "tiny")


@pytest.fixture(scope="module")
def on_threads(
    plancurate_on_shared_server: Command, new_home: NewHome, tmp_path_factory: pytest.TempPathFactory
) -> Rows:
    return rows_of_a_run(plancurate_on_shared_server, new_home(tmp_path_factory.mktemp("threads")), "threads")


@pytest.mark.parametrize("runner", ["processes", "dask"])
def test_a_study_writes_the_same_rows_on_every_runner(
    plancurate_on_shared_server: Command,
    on_threads: Rows,
    new_home: NewHome,
    tmp_path: Path,
    runner: str,
) -> None:
    assert all(on_threads)
    assert rows_of_a_run(plancurate_on_shared_server, new_home(tmp_path), runner) == on_threads


def test_studies_at_once_in_a_home_write_what_each_writes_alone(
    commands: Commands, shared_server: str, on_threads: Rows, new_home: NewHome, tmp_path: Path
) -> None:
    home = new_home(tmp_path / "home")
    started = [
        commands.start(*words(home, name, "threads"), PREFECT_API_URL=shared_server)
        for name in ("tiny", "other")
    ]
    for one in started:
        done = one.result()
        assert done.returncode == 0, done.stderr
    assert rows(home, "tiny") == rows(home, "other") == on_threads
    assert_sound(home)
