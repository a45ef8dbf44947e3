"""The control that betters every candidate instead of choosing among them."""

from __future__ import annotations

import hashlib

import numpy as np

from plancurate import native
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.tasks.candidates.polylines import path_length
from plancurate.tasks.candidates.settings import TimingSettings
from plancurate.tasks.candidates.time_parameterisation import time_path
from plancurate.tasks.curation.pool import FloatArray
from plancurate.tasks.curation.selectors.base import Kept, Problem, Settings, selector

SHORTER = 0.999
"""A repair is worth timing, and worth keeping, at less than this part of the stored length."""


@selector("Repair", budgeted=False, uses=("timing",))
def repair(problem: Problem, settings: Settings) -> Kept:
    """Keep the whole pool, with every trajectory shortened, smoothed and timed as the study times its paths.

    A trajectory that the repair would not shorten, or that can't be timed free of collision and within the
    limits afterwards, keeps its stored waypoints.
    """
    candidates = problem.pool.candidates
    with problem.stage("prepare"):
        stored = problem.waypoints(candidates["trajectory_id"].to_pylist())
    done: dict[tuple[bytes, float], FloatArray] = {}  # planners find many a trajectory more than once
    repaired = []
    with problem.stage("select"):
        for q, dt in zip(stored, candidates["dt"].to_pylist(), strict=True):
            key = (q.tobytes(), dt)
            if key not in done:
                timing = problem.learning.timing.model_copy(update={"dt": dt})
                done[key] = repaired_trajectory(problem.robot, problem.scene, q, timing, problem.seed)
            repaired.append(done[key])
    return Kept(np.arange(candidates.num_rows), q=repaired)


def repaired_trajectory(
    robot: Robot, scene: Scene, q: FloatArray, timing: TimingSettings, seed: int
) -> FloatArray:
    """Shorten, smooth and time again the trajectory `q` (m, n), rad, sampled every `timing.dt` s.

    Starts and ends where `q` does. Returns samples (k, n) at the same rate that are free and within the limits
    and take a shorter way through joint space, or `q` itself.
    """
    try:
        path = native.simplify(
            robot.native, scene.native, q, seed=_seed_of(seed, q), resolution=timing.resolution
        )
    except ValueError:  # not free at this resolution: it was planned with a coarser one
        return q
    if path_length(path) >= SHORTER * path_length(q):
        return q
    timed = time_path(robot, scene, path, timing)
    better = not timed.reason and path_length(timed.q) < SHORTER * path_length(q)
    return timed.q if better else q


def _seed_of(seed: int, q: FloatArray) -> int:
    """A seed of the trajectory's own, the same whatever else is in the pool."""
    digest = hashlib.sha256(f"{seed}/".encode() + np.ascontiguousarray(q).tobytes()).digest()
    return int.from_bytes(digest[:8], "big")
