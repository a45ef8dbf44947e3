from __future__ import annotations

import numpy as np
import pyarrow as pa
import pytest

from plancurate.errors import PlancurateError
from plancurate.tasks.curation.pool import load_pool, load_waypoints, make_pool
from plancurate.tasks.lake.schema import table
from plancurate.tasks.lake.store import Lake

from ..lakes import trajectory

PARTITION = {"robot": "h2017", "scene": "free", "pool": "0a1b2c"}


def test_pool_holds_solved_and_verified_candidates_in_order(small_lake: Lake) -> None:
    pool = load_pool(small_lake, PARTITION)
    keys = [pool.candidates[name].to_pylist() for name in ("target_id", "planner", "run")]
    rows = list(zip(*keys, strict=True))
    assert rows == sorted(rows)
    assert len(rows) == 16  # of 18: one failed, one is not verified
    assert {(1, "RRT", 1), (1, "RRT", 2)}.isdisjoint(rows)
    assert pool.n_targets == 3


def test_pool_can_be_cut_to_targets_and_planners(small_lake: Lake) -> None:
    pool = load_pool(small_lake, PARTITION, targets=[2, 0], planners=["PRM"])
    assert set(pool.candidates["target_id"].to_pylist()) == {0, 2}
    assert set(pool.candidates["planner"].to_pylist()) == {"PRM"}
    assert pool.targets["target_id"].to_pylist() == [0, 2]


def test_pool_hash_depends_on_content_and_not_on_row_order(small_lake: Lake) -> None:
    pool = load_pool(small_lake, PARTITION)
    rows = pool.candidates
    shuffled = rows.take(np.random.default_rng(0).permutation(rows.num_rows))
    assert make_pool(PARTITION, shuffled, pool.targets).hash == pool.hash
    lengths = rows["path_length"].to_numpy().copy()
    lengths[3] = np.nextafter(lengths[3], 10)
    changed = rows.set_column(rows.column_names.index("path_length"), "path_length", pa.array(lengths))
    assert make_pool(PARTITION, changed, pool.targets).hash != pool.hash
    assert make_pool(PARTITION, rows.slice(1), pool.targets).hash != pool.hash


def test_pool_hash_is_the_same_in_every_process_and_version(small_lake: Lake) -> None:
    assert load_pool(small_lake, PARTITION).hash == load_pool(Lake(small_lake.root), PARTITION).hash


def test_unknown_target_and_empty_pool_are_one_line_errors(small_lake: Lake) -> None:
    with pytest.raises(PlancurateError, match="target 9 was never generated"):
        load_pool(small_lake, PARTITION, targets=[0, 9])
    with pytest.raises(PlancurateError, match=r"pool nothing of h2017 in free is empty") as caught:
        load_pool(small_lake, {**PARTITION, "pool": "nothing"})
    assert "\n" not in str(caught.value)


def test_waypoints_come_in_the_order_asked_for(small_lake: Lake) -> None:
    ids = load_pool(small_lake, PARTITION).candidates["trajectory_id"].to_pylist()[:5][::-1]
    waypoints = load_waypoints(small_lake, PARTITION, ids)
    stored = dict(
        zip(*small_lake.sql("SELECT trajectory_id, q FROM trajectories").to_pydict().values(), strict=True)
    )
    for name, q in zip(ids, waypoints, strict=True):
        assert q.shape == (11, 3)
        np.testing.assert_array_equal(q, stored[name])


def test_waypoints_of_an_unknown_trajectory_are_an_error(small_lake: Lake) -> None:
    with pytest.raises(PlancurateError, match="no trajectory t9"):
        load_waypoints(small_lake, PARTITION, ["t9"])


def test_copies_are_thinned_to_one_that_says_how_many_there_were(small_lake: Lake) -> None:
    before = load_pool(small_lake, PARTITION)
    copies = [
        trajectory(0, "RRT", 0) | {"trajectory_id": f"t0000-ABIT-r{run}", "run": run} for run in range(4)
    ]
    other_target = trajectory(0, "RRT", 0) | {"trajectory_id": "t0001-ABIT-r0", "target_id": 1}
    part = pa.Table.from_pylist([*copies, other_target], table("trajectories").schema)
    small_lake.write("trajectories", {**PARTITION, "planner": "ABIT"}, "000000", part, {})
    pool = load_pool(small_lake, PARTITION)
    found = dict(
        zip(*(pool.candidates[c].to_pylist() for c in ("trajectory_id", "multiplicity")), strict=True)
    )
    assert found.pop("t0000-ABIT-r0") == 5  # stands for the one of RRT as well
    assert set(found.values()) == {1}
    assert "t0001-ABIT-r0" in found
    assert len(found) == before.candidates.num_rows
    assert pool.hash != before.hash
    without = load_pool(small_lake, PARTITION, planners=["RRT", "PRM"])
    assert without.hash == before.hash
