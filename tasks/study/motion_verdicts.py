"""Rollouts of a study's networks as motions: those that reach their test are timed and verified."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyarrow as pa
import torch

from plancurate.errors import PlancurateError
from plancurate.robots import Scene
from plancurate.tasks.lake.schema import table
from plancurate.tasks.motion.rollout import PolicyPath, policy_paths
from plancurate.tasks.motion.timed import timed_motion
from plancurate.tasks.motion.verify import verify_motion
from plancurate.tasks.study.context import PoolContext, StudyContext
from plancurate.tasks.study.evaluations import evaluation_id, goals_at
from plancurate.tasks.study.networks import Network, load_network, wanted_networks
from plancurate.tasks.study.scenes import rows_by_scene
from plancurate.tasks.study.selections import study_selections

ROLLOUT, TIMING = "rollout", "timing"
"""What a motion fails at before the verifier sees it."""


def missing_verdicts(study: StudyContext) -> list[Network]:
    """Return the networks, after their last round, whose rollouts are to be verified and are not yet."""
    if not study.config.verified_tests:
        return []
    known = {
        pool.pool: study.lake.keys("motion_verdicts", study.study_partition(pool)) for pool in study.pools
    }
    return [
        network
        for network in wanted_networks(study, study_selections(study))
        if network.round == study.config.corrections.rounds
        and evaluation_id(study, network) not in known[network.selection.pool]
    ]


def verify_rollouts(study: StudyContext, networks: Sequence[Network]) -> int:
    """Verify rollouts of networks of one pool and write one part of verdicts for each; gives how many networks."""
    torch.set_num_threads(1)  # a group a core, as in training
    pool = study.pool(networks[0].selection.pool)
    for network in networks:
        rows = verdict_rows(study, pool, network)
        part = pa.Table.from_pylist(rows, schema=table("motion_verdicts").schema)
        key = evaluation_id(study, network)
        study.lake.write("motion_verdicts", study.study_partition(pool), key, part, study.metadata)
    return len(networks)


def verdict_rows(study: StudyContext, pool: PoolContext, network: Network) -> list[dict[str, Any]]:
    """Return a row for each test that a network reached, of those that the study verifies."""
    key = evaluation_id(study, network)
    partition, tests = study.study_partition(pool), study.config.verified_tests
    reached = study.lake.query("study/reached", evaluation_id=key, tests=tests, **partition).to_pylist()
    if not reached:
        return []
    policy = load_network(study, network)
    positions = np.array([[test["x"], test["y"], test["z"]] for test in reached])
    scenes = pool.scenes_of_tests([test["kind"] for test in reached], [test["target_id"] for test in reached])
    goals = goals_at(study, pool, policy.goals, scenes, positions, [test["test_id"] for test in reached])
    settings, dt = study.config.evaluation, pool.settings.timing.dt
    rows = []
    for scene, own in rows_by_scene(scenes):
        shown = None if goals is None else goals[own]
        paths = policy_paths(policy, pool.robot, scene, positions[own], settings, dt, shown)
        for test, path in zip((reached[i] for i in own), paths, strict=True):
            tested = {"evaluation_id": key, "kind": test["kind"], "test_id": test["test_id"]}
            rows.append(tested | verdict_on(pool, scene, path))
    return rows


def verdict_on(pool: PoolContext, scene: Scene, path: PolicyPath) -> dict[str, Any]:
    """Time a policy's path as `predict` does, and say whether the robot may run it, or what is wrong first."""
    if path.reason:
        return judged(ROLLOUT, path.reason)
    try:
        motion = timed_motion(pool.robot, scene, path.path, pool.settings.timing)
    except PlancurateError as error:
        return judged(TIMING, str(error))
    verdict = verify_motion(pool.robot, scene, motion, payload=pool.settings.verify.payload)
    first, duration = verdict.first, float(motion.times[-1])
    return judged("", "", duration) if first is None else judged(first.check, first.sentence, duration)


def judged(failed_check: str, reason: str, duration: float | None = None) -> dict[str, Any]:
    """What is recorded of a motion: what is wrong first, if anything is, and how long it takes, s."""
    return {"passed": not failed_check, "failed_check": failed_check, "reason": reason, "duration": duration}
