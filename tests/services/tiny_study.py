"""A study as small as can be, and all rows of it that its settings decide."""

from __future__ import annotations

from pathlib import Path

from plancurate.tasks.lake.store import Lake

from ..integration.conftest import Command

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
