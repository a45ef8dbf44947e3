"""Motions along a path, from rest to rest within velocity and acceleration limits, sampled at a fixed step.

Samples are (m, n) joint positions in rad, paths (w, n) distinct waypoints. A motion is slowed down a little,
so that it takes a multiple of the time step; its first and last samples are exactly the path's ends.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.polylines import travelled

GRID_POINTS = 100  # of toppra: durations within 2 % of those of a grid twice as fine, at 60 % of its time
GRID_POINTS_PER_KNOT = 3  # of a spline with many knots, whose curvature changes from one to the next
MAX_STRETCHES = 5


@dataclass(frozen=True, eq=False)
class Pace:
    """Velocity (n,), rad/s, and acceleration (n,), rad/s^2, that a motion may use, and the time step, s."""

    velocity: FloatArray
    acceleration: FloatArray
    dt: float

    def steps(self, duration: float) -> int:
        """Count the time steps that `duration` (s) needs; a rounding error doesn't cost one."""
        return max(1, int(np.ceil(duration / self.dt - 1e-9)))

    def excess(self, q: FloatArray) -> float:
        """Return by what factor samples `q` (m, n) must be slowed down to keep the limits; <= 1 if they do.

        Judged by finite differences, with rest before the first and after the last sample.
        """
        held = np.concatenate([q[:1], q, q[-1:]])
        speed = np.abs(np.diff(held, axis=0)) / self.dt / self.velocity
        change = np.abs(np.diff(held, n=2, axis=0)) / self.dt**2 / self.acceleration
        return float(max(speed.max(), np.sqrt(change.max())))


def straight_samples(a: FloatArray, b: FloatArray, pace: Pace) -> FloatArray:
    """Sample the fastest straight motion from `a` (n,) to `b` (n,): a trapezoid of speed."""
    distance = np.abs(b - a)
    if not distance.any():
        return np.array([a, b])
    moving = distance > 0
    top_speed = np.min(pace.velocity[moving] / distance[moving])  # of s, which goes from 0 to 1
    ramp = np.min(pace.acceleration[moving] / distance[moving])
    ramp_time = min(top_speed / ramp, 1 / np.sqrt(ramp))
    end = 1 / (ramp * ramp_time) + ramp_time
    t = np.linspace(0, end, pace.steps(end) + 1)
    s = np.where(t < ramp_time, ramp * t**2 / 2, ramp * ramp_time * (t - ramp_time / 2))
    s = np.where(t > end - ramp_time, 1 - ramp * (end - t) ** 2 / 2, s)
    return with_ends(a + s[:, None] * (b - a), a, b)


def stopping_samples(path: FloatArray, pace: Pace) -> FloatArray:
    """Sample straight motions with a stop at each waypoint of `path`, w >= 2, which is one of the samples."""
    pieces = [straight_samples(a, b, pace)[1:] for a, b in pairwise(path)]
    return np.concatenate([path[:1], *pieces])


def spline_samples(path: FloatArray, pace: Pace, longest: int) -> FloatArray:
    """Sample the fastest motion along a natural cubic spline through `path`, w >= 3.

    Returns (0, n) when toppra finds none of at most `longest` samples: one that must crawl is useless.
    """
    import toppra  # at the first use: it takes most of a second and brings all of matplotlib
    from toppra.algorithm import TOPPRA
    from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint

    logging.getLogger("toppra").setLevel(logging.CRITICAL)  # what it warns of is in its answer
    knots = travelled(path)
    spline = toppra.SplineInterpolator(knots, path, "natural")
    limits = [JointVelocityConstraint(pace.velocity), JointAccelerationConstraint(pace.acceleration)]
    grid = grid_of(knots)
    _, speeds, _ = TOPPRA(limits, spline, grid, solver_wrapper="seidel").compute_parameterization(0, 0)
    if speeds is None or not np.all(speeds[1:] + speeds[:-1] > 0):
        return path[:0]
    motion = toppra.ParametrizeConstAccel(spline, grid, speeds)
    samples = with_ends(paced_samples(motion, motion.duration, pace), path[0], path[-1])
    return samples if len(samples) <= longest else samples[:0]


def grid_of(knots: FloatArray) -> FloatArray:
    """Return toppra's grid of path positions: all `knots` (w,), and points in between by length."""
    total = max(GRID_POINTS, GRID_POINTS_PER_KNOT * len(knots))
    counts = np.ceil(np.diff(knots) / knots[-1] * total).astype(int)
    inner = [np.linspace(a, b, c + 1)[1:] for (a, b), c in zip(pairwise(knots), counts, strict=True)]
    return np.concatenate([knots[:1], *inner])


def paced_samples(motion: Callable[[FloatArray], FloatArray], duration: float, pace: Pace) -> FloatArray:
    """Sample `motion` (times (m,) -> q (m, n)), slowed down until the samples keep the limits."""
    steps = pace.steps(duration)
    for _ in range(MAX_STRETCHES):
        samples = motion(np.linspace(0, duration, steps + 1))
        excess = pace.excess(samples)
        if excess <= 1 + 1e-9:
            break
        steps = int(np.ceil(steps * excess))
    return samples


def subdivided(path: FloatArray, spacing: float) -> FloatArray:
    """Put points on the segments of `path`, so that none is longer than `spacing` (rad).

    All segments at once, each rounded as np.linspace rounds one: where a joint rests, it multiplies after it divides.
    """
    change = np.diff(path, axis=0)
    counts = np.maximum(np.ceil(np.linalg.norm(change, axis=1) / spacing).astype(int), 1)
    last = np.cumsum(counts) - 1
    segment = np.repeat(np.arange(len(counts)), counts)
    number = np.arange(len(segment)) - last[segment] + counts[segment]  # of a segment's point, from 1
    step = change / counts[:, None]
    resting = (step == 0).any(axis=1)[segment, None]
    share = (number / counts[segment])[:, None]
    points = path[segment] + np.where(resting, share * change[segment], number[:, None] * step[segment])
    points[last] = path[1:]
    return np.concatenate([path[:1], points])


def with_ends(samples: FloatArray, first: FloatArray, last: FloatArray) -> FloatArray:
    """Set the ends of `samples`, which arithmetic meets all but the last bit."""
    return np.concatenate([first[None], samples[1:-1], last[None]])
