"""One policy for all clusters, or one for each: two readings of the publication, on development targets alone.

    python experiments/each_cluster.py [--home data/development] [--scenes table shelf] [--json rates.json]

The publication may be read so that a policy is trained for each cluster and the one "corresponding to the target point"
is used. KMeans_Hybrid keeps as many trajectories in many small clusters (as many as targets) or in a quarter as many;
BC_MLP is trained on all of them, or a network on each cluster, and a test target is left to the network of the cluster
whose ends are nearest. Tested are targets beside trained ones and unseen ones. Pools (those of development.yaml) are
those of parameters.py.
"""

from __future__ import annotations

import argparse
import json
import sys
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
import pyarrow.compute as pc
import torch
from parameters import CONFIG, OPTIONS, POLICY, generate, percent
from scipy.spatial.distance import cdist

from plancurate.errors import PlancurateError
from plancurate.tasks.candidates.targets import sample_targets
from plancurate.tasks.curation.pool import FloatArray, columns
from plancurate.tasks.curation.selectors.base import IntArray
from plancurate.tasks.curation.selectors.selection import Selection
from plancurate.tasks.lake.home import Home
from plancurate.tasks.learning.demonstrations import demonstrations
from plancurate.tasks.learning.policies import TrainedPolicy
from plancurate.tasks.learning.rollouts import BoolArray, roll_out
from plancurate.tasks.learning.test_targets import TargetsUnderTest, displaced_tests, join_tests, unseen_tests
from plancurate.tasks.learning.train import train
from plancurate.tasks.study.config import load_config
from plancurate.tasks.study.context import PoolContext, StudyContext, open_study
from plancurate.tasks.study.demonstrations import positions, selected_waypoints
from plancurate.tasks.study.selections import make_selection, study_pool, study_selections
from plancurate.tasks.study.statistics import wilson_interval

SHARES_AND_BUDGETS = ((1.0, 3), (0.25, 12))
"""Clusters by number of targets, and what is kept of each: as many trajectories in all."""


@dataclass(frozen=True)
class Rate:
    """Successes of n tests of one kind."""

    scene: str
    clusters: int
    reading: Literal["one for all", "one for each"]
    kind: str
    n: int
    successes: int


def main() -> None:
    """Measure both readings for both sizes of clusters in every scene."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--home", type=Path, default=Path("data/development"))
    parser.add_argument("--scenes", nargs="*", default=load_config("smoke", CONFIG, {}).scenes)
    parser.add_argument("--json", type=Path)
    asked = parser.parse_args()
    generate(asked.home)
    warnings.simplefilter("ignore")
    torch.set_num_threads(1)
    rates = []
    for share, budget in SHARES_AND_BUDGETS:
        selector = {"name": "KMeans_Hybrid", "clusters_share": share}
        changed = {
            "selectors": [selector],
            "budgets": [budget],
            "selection_seeds": [0],
            "scenes": asked.scenes,
        }
        study = open_study(load_config("smoke", CONFIG, {**OPTIONS, **changed}), Home.resolve(asked.home))
        for wanted in study_selections(study):
            for rate in measured(study, study.pool(wanted.pool), make_selection(study, wanted)):
                interval = wilson_interval(rate.successes, rate.n)
                shown = percent(rate.successes / rate.n, interval)
                print(
                    f"{rate.scene:6} {rate.clusters:3} clusters, {rate.reading:12} {rate.kind:9} {shown}",
                    flush=True,
                )
                rates.append(rate)
    if asked.json:
        asked.json.write_text(json.dumps([asdict(rate) for rate in rates], indent=1) + "\n", encoding="utf-8")


def measured(study: StudyContext, pool: PoolContext, selection: Selection) -> Iterator[Rate]:
    """Train on all kept trajectories and on those of each cluster, and test."""
    kept = selection.kept
    cluster, target = kept["cluster"].to_numpy(), positions(study, pool, kept["target_id"].to_pylist())
    paths = selected_waypoints(study, selection, pool.partition)
    members = [np.arange(len(kept)), *(np.flatnonzero(cluster == one) for one in np.unique(cluster))]
    data = [
        demonstrations(
            pool.robot, pool.scene, [paths[row] for row in rows], target[rows], study.config.training
        )
        for rows in members
    ]
    for_all, *for_each = train(POLICY, data, [0] * len(data), study.config.training)
    tests = tests_of(study, pool)
    own = nearest_cluster(tests.position, ends(study, pool, selection), members[1:])
    everywhere = np.zeros(len(tests), np.int64)
    readings = {"one for all": ([for_all], everywhere), "one for each": (for_each, own)}
    for reading, (networks, of_test) in readings.items():
        success = successes(study, pool, networks, tests, of_test)
        for kind in dict.fromkeys(tests.kind):
            here = success[np.array(tests.kind) == kind]
            yield Rate(pool.scene.name, len(for_each), reading, kind, len(here), int(here.sum()))


def tests_of(study: StudyContext, pool: PoolContext) -> TargetsUnderTest:
    """Development targets: beside those of the pool, and unseen ones."""
    settings, seed = pool.settings.targets, study.config.evaluation.seed
    fresh = settings.model_copy(update={"seed": seed})
    trained = sample_targets(pool.robot, pool.scene, settings, 0, study.config.n_targets)
    unseen = sample_targets(pool.robot, pool.scene, fresh, 0, study.config.unseen)
    return join_tests(displaced_tests(trained, seed), unseen_tests(unseen))


def ends(study: StudyContext, pool: PoolContext, selection: Selection) -> FloatArray:
    """Final tool positions (kept, 3), m, of the kept trajectories."""
    candidates = study_pool(study, pool).candidates
    rows = pc.index_in(selection.kept["trajectory_id"], candidates["trajectory_id"])
    return columns(candidates.take(rows), ("tool_x", "tool_y", "tool_z"))


def nearest_cluster(position: FloatArray, ends: FloatArray, members: Sequence[IntArray]) -> IntArray:
    """Number of the cluster (tests,) whose mean end is nearest to a position (tests, 3)."""
    return np.asarray(cdist(position, [ends[rows].mean(axis=0) for rows in members]).argmin(axis=1))


def successes(
    study: StudyContext,
    pool: PoolContext,
    networks: Sequence[TrainedPolicy],
    tests: TargetsUnderTest,
    of_test: IntArray,
) -> BoolArray:
    """Whether each test (tests,) succeeds that is left to the network of that number."""
    success, dt = np.zeros(len(tests), np.bool_), pool.settings.timing.dt
    for number in np.unique(of_test):
        rows = np.flatnonzero(of_test == number)
        some = replace(
            tests,
            kind=tuple(tests.kind[row] for row in rows),
            **{
                name: getattr(tests, name)[rows]
                for name in ("target_id", "distance_cm", "position", "test_id")
            },
        )
        (table,) = roll_out([networks[number]], pool.robot, pool.scene, some, study.config.evaluation, dt)
        success[rows] = table["success"].to_pylist()
    return success


if __name__ == "__main__":
    try:
        main()
    except PlancurateError as error:
        sys.exit(f"{error}")
