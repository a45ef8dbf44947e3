"""A study's references: what a planner, a replayed trajectory and a straight line reach of its tests."""

from __future__ import annotations

from functools import partial

import numpy as np
import numpy.typing as npt
import pyarrow as pa
from scipy.spatial import KDTree

from plancurate import native
from plancurate.tasks.curation.pool import FloatArray, Pool, columns, load_waypoints
from plancurate.tasks.curation.selectors.selection import select
from plancurate.tasks.lake.schema import table
from plancurate.tasks.learning.test_targets import TargetsUnderTest
from plancurate.tasks.study.context import PoolContext, StudyContext
from plancurate.tasks.study.evaluations import study_tests, tested_scenes
from plancurate.tasks.study.reference_results import PLANNER, REPLAY, STRAIGHT_LINE
from plancurate.tasks.study.selections import study_pool

PART = "all"  # of a study's pool, for the study's key says what it depends on
BoolArray = npt.NDArray[np.bool_]
IntArray = npt.NDArray[np.int64]


def missing_references(study: StudyContext) -> list[PoolContext]:
    """Return the pools whose references the lake lacks."""
    return [
        pool
        for pool in study.pools
        if PART not in study.lake.keys("reference_trials", study.study_partition(pool))
    ]


def make_references(study: StudyContext, pool: PoolContext) -> int:
    """Record what each reference reaches of a pool's tests; gives how many tests."""
    tests = study_tests(study, pool)
    assert tests.planned is not None
    assert tests.hard is not None
    best = best_of_targets(study, pool)
    reached = {
        PLANNER: tests.planned,
        REPLAY: replayed(best, tests.position, study.config.evaluation.reach_m)
        & free_there(study, pool, best, tests),
        STRAIGHT_LINE: ~tests.hard,
    }
    rows = pa.concat_tables([reference_rows(name, tests, success) for name, success in reached.items()])
    study.lake.write("reference_trials", study.study_partition(pool), PART, rows, study.metadata)
    return len(tests)


def best_of_targets(study: StudyContext, pool: PoolContext) -> pa.Table:
    """Return the candidate with the best composite score of each target that has one."""
    loaded = study_pool(study, pool)
    ranked = ranked_candidates(study, pool, loaded)
    first = np.unique(ranked["target_id"].to_numpy(), return_index=True)[1]
    return rows_of(loaded, ranked["trajectory_id"].take(first).to_pylist())


def ranked_candidates(study: StudyContext, pool: PoolContext, loaded: Pool) -> pa.Table:
    """Return all candidates of a loaded pool with their composite scores, the best first."""
    everything = select(  # all candidates, ranked
        "RuleBased_General",
        loaded,
        loaded.candidates.num_rows,
        0,
        robot=pool.robot,
        scene=pool.scene,
        waypoints=partial(load_waypoints, study.lake, pool.partition),
        learning=pool.learning(study.config),
    )
    return everything.kept.sort_by("rank")


def rows_of(pool: Pool, ids: list[str]) -> pa.Table:
    """Return candidates by id."""
    number = {name: row for row, name in enumerate(pool.candidates["trajectory_id"].to_pylist())}
    return pool.candidates.take([number[name] for name in ids])


def nearest_of(best: pa.Table, positions: FloatArray) -> IntArray:
    """Which of the best trajectories leads to the training target nearest to each of positions (t, 3), m."""
    return np.asarray(KDTree(columns(best, ("target_x", "target_y", "target_z"))).query(positions)[1])


def replayed(best: pa.Table, positions: FloatArray, reach_m: float) -> BoolArray:
    """Whether the best trajectory to the nearest training target ends within `reach_m` of positions (t, 3), m."""
    ends = columns(best, ("tool_x", "tool_y", "tool_z"))[nearest_of(best, positions)]
    return np.asarray(np.linalg.norm(ends - positions, axis=1) < reach_m)


def free_there(
    study: StudyContext, pool: PoolContext, best: pa.Table, tests: TargetsUnderTest
) -> BoolArray | np.bool_:
    """Whether the trajectory that is replayed is free in each test's scene; it is where all share one."""
    if pool.family is None:
        return np.True_
    ids = best["trajectory_id"].take(nearest_of(best, tests.position)).to_pylist()
    path = dict(zip(ids, load_waypoints(study.lake, pool.partition, ids), strict=True))
    resolution, scenes = study.config.evaluation.resolution, tested_scenes(pool, tests)
    edges = [(scene.native, path[name][:-1], path[name][1:]) for scene, name in zip(scenes, ids, strict=True)]
    free = [native.edge_is_free(pool.robot.native, *edge, resolution).all() for edge in edges]
    return np.array(free, dtype=bool)


def reference_rows(reference: str, tests: TargetsUnderTest, success: BoolArray) -> pa.Table:
    """Return rows of `reference_trials`, one a test."""
    same = {"reference": [reference] * len(tests), "success": success}
    return pa.table(tests.columns() | same, schema=table("reference_trials").schema)
