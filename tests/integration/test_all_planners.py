"""All 23 planners through the whole of `generate`: the same rows with any number of workers, free for PyBullet."""

from __future__ import annotations

import numpy as np
import pytest

from plancurate.robots import load_robot, load_scene
from plancurate.tasks.lake.store import Lake

from ..homes import NewHome
from .conftest import Command


@pytest.fixture(scope="module")
def lakes(
    plancurate: Command, new_home: NewHome, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Lake]:
    """One target, every planner, planned with 1 worker and with 4."""
    found = {}
    for workers in ("1", "4"):
        home = new_home(tmp_path_factory.mktemp(f"workers{workers}"))
        words = ("generate", "--scene", "table", "--targets", "1", "--workers", workers, "--home", str(home))
        done = plancurate(*words)
        assert done.returncode == 0, done.stderr
        found[workers] = Lake(home / "lake")
    return found


def test_the_number_of_workers_changes_no_trajectory(lakes: dict[str, Lake]) -> None:
    statement = (
        "SELECT trajectory_id, seed, solved, reason, state_checks, q FROM trajectories ORDER BY trajectory_id"
    )
    one, four = (lakes[workers].sql(statement).to_pylist() for workers in ("1", "4"))
    assert len(one) == 23 * 3
    assert one == four


def test_all_planners_solve_their_runs(lakes: dict[str, Lake]) -> None:
    unsolved = "SELECT planner, run, reason FROM trajectories WHERE NOT solved"
    assert lakes["1"].sql(unsolved).num_rows <= 0.05 * 23 * 3


def test_every_stored_waypoint_and_edge_is_free_for_pybullet(lakes: dict[str, Lake], judge) -> None:
    referee = judge(load_robot("h2017"), load_scene("table"))
    for row in lakes["1"].sql("SELECT q FROM trajectories WHERE solved").to_pylist():
        assert referee.penetration_on_edges(np.array(row["q"])).max() <= 0
