"""A study gives the same rows wherever its task runs work: threads, processes, or a Dask cluster."""

from __future__ import annotations

from pathlib import Path

import pytest

from plancurate.tasks.lake.store import Lake

from ..homes import NewHome
from .conftest import Command

TINY = """
n_targets: 2
planners: [RRTConnect, PRM]
candidates: {plan: {runs: 1}}
selectors: [General, KMeans_Hybrid]
budgets: [1]
policies: [BC_MLP, BC_RNN]
training: {steps: 20}
"""
# Everything but what was measured.
ROWS = (
    "SELECT * EXCLUDE (plan_s, timing_s, verify_s) FROM trajectories ORDER BY trajectory_id",
    "SELECT study, selection_id, trajectory_id, rank, score FROM selections ORDER BY ALL",
    "SELECT * EXCLUDE (selection_time_s, train_s) FROM evaluations ORDER BY evaluation_id, kind, test_id",
)


def rows(plancurate: Command, home: Path, runner: str) -> list[list[dict[str, object]]]:
    """Run the tiny study in a home of its own and return what it wrote."""
    file = home / "tiny.yaml"
    file.write_text(f"{TINY}runner: {runner}\n")
    done = plancurate("study", "--config", str(file), "--name", "tiny", "--home", str(home))
    assert done.returncode == 0, done.stderr
    return [Lake(home / "lake").sql(query).to_pylist() for query in ROWS]


@pytest.fixture(scope="module")
def on_threads(
    plancurate: Command, new_home: NewHome, tmp_path_factory: pytest.TempPathFactory
) -> list[list[dict[str, object]]]:
    return rows(plancurate, new_home(tmp_path_factory.mktemp("threads")), "threads")


@pytest.mark.parametrize("runner", ["processes", "dask"])
def test_a_study_writes_the_same_rows_on_every_runner(
    plancurate: Command,
    on_threads: list[list[dict[str, object]]],
    new_home: NewHome,
    tmp_path: Path,
    runner: str,
) -> None:
    assert all(on_threads)
    assert rows(plancurate, new_home(tmp_path), runner) == on_threads
