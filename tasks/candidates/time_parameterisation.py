"""Time a planned path: where the robot is when, within its velocity and acceleration limits.

Ways to do it, tried in this order, since the earlier ones give smoother and shorter trajectories:

`spline`    a cubic spline through the path's waypoints, timed by toppra
`dense`     the same through many points of the path, so that the spline hardly leaves it
`stops`     straight from waypoint to waypoint, standing still at each

(A path of two waypoints is `straight`: nothing to stop at. Samples that came timed are `recorded`.) What is stored is
what counts, so each attempt is judged by its samples, rounded to float32: inside the limits, and free along every edge
between them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from plancurate import native
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.limits import limit_problem
from plancurate.tasks.candidates.motions import Pace, spline_samples, stopping_samples, subdivided
from plancurate.tasks.candidates.settings import TimingSettings

SHORTEST_SEGMENT = 1e-4  # rad: nearer waypoints are one; a spline between them would turn on the spot


@dataclass(frozen=True, eq=False)
class Timed:
    """A trajectory: samples `q` (m, n), rad, all float32 numbers, one a time step; (0, n) if it failed.

    `duration` is in s, `method` one of those above, `reason` says why each of them failed, if all did.
    """

    q: FloatArray
    duration: float
    method: str
    reason: str


def time_path(robot: Robot, scene: Scene, path: FloatArray, settings: TimingSettings) -> Timed:
    """Time `path` (w, n), rad, w >= 1, from rest to rest; a path that goes nowhere is held for one step."""
    failures = []
    for method, samples in attempts(robot, without_repeats(path), settings):
        q = samples.astype(np.float32).astype(np.float64)
        problem = problem_of(robot, scene, q, settings)
        if not problem:
            return Timed(q, (len(q) - 1) * settings.dt, method, "")
        failures.append(f"{method}: {problem}")
    return Timed(np.empty((0, robot.dof)), 0.0, "", "; ".join(failures))


def as_sampled(robot: Robot, scene: Scene, q: FloatArray, settings: TimingSettings) -> Timed:
    """Take samples `q` (m, n), rad, of somebody else's timing, float32 numbers, held to the same as ours."""
    problem = problem_of(robot, scene, q, settings)
    if problem:
        return Timed(np.empty((0, robot.dof)), 0.0, "", problem)
    return Timed(q, (len(q) - 1) * settings.dt, "recorded", "")


def without_repeats(path: FloatArray) -> FloatArray:
    """Drop waypoints of `path` (w, n) that repeat the one before; both ends stay: two rows or more."""
    distinct = [path[0]]
    for waypoint in path[1:-1]:
        if min(np.linalg.norm(waypoint - other) for other in (distinct[-1], path[-1])) > SHORTEST_SEGMENT:
            distinct.append(waypoint)
    return np.array([*distinct, path[-1]])


def attempts(robot: Robot, path: FloatArray, settings: TimingSettings) -> Iterator[tuple[str, FloatArray]]:
    """Yield (method, samples (m, n)), the best way first; each is computed when it is asked for."""
    share = settings.limit_share
    pace = Pace(share * robot.velocity, share * robot.acceleration, settings.dt)
    stopping = stopping_samples(path, pace)
    if len(path) == 2:
        yield "straight", stopping
        return
    yield "spline", spline_samples(path, pace, len(stopping))
    yield "dense", spline_samples(subdivided(path, settings.dense_spacing), pace, len(stopping))
    yield "stops", stopping


def problem_of(robot: Robot, scene: Scene, q: FloatArray, settings: TimingSettings) -> str:
    """Say in a few words what is wrong with the samples `q` (m, n), or nothing ("")."""
    if len(q) == 0:
        return "no motion faster than with stops"
    if problem := limit_problem(robot, q, settings.dt):
        return problem
    if not np.all(native.edge_is_free(robot.native, scene.native, q[:-1], q[1:], settings.resolution)):
        return "collides"
    return ""
