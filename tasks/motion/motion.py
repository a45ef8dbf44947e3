"""A motion as somebody gives it, and what the robot does between its samples."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BPoly, CubicHermiteSpline

from plancurate.robots import Robot
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.playback import rest_to_rest

LONGEST_MEAN = 0.1  # s over which accelerations of a motion without velocities are means
SHORTEST_MEAN = 1e-3  # s, of one with velocities


@dataclass(frozen=True, eq=False)
class Motion:
    """Samples of m joint states of n joints: times (m,) in s, the rest (m, n) in rad (m) and s."""

    times: FloatArray
    positions: FloatArray
    velocities: FloatArray | None = None
    accelerations: FloatArray | None = None
    joint_names: tuple[str, ...] | None = None
    """Names of the columns where the source gives them."""


@dataclass(frozen=True, eq=False)
class Curve:
    """Where the joints are at any time: at rest before `start` and after `end`, s."""

    start: float
    end: float
    path: Callable[[FloatArray], FloatArray]
    """(t,) -> (t, n), between start and end."""
    slope: Callable[[FloatArray], FloatArray]
    mean_s: float
    """Time over which accelerations and jerks are means; samples say nothing of shorter ones."""

    def position(self, t: FloatArray) -> FloatArray:
        """Joint positions (t, n), rad."""
        return np.asarray(self.path(np.clip(t, self.start, self.end)))

    def velocity(self, t: FloatArray) -> FloatArray:
        """Joint velocities (t, n), rad/s."""
        moving = (t >= self.start) & (t <= self.end)
        return np.where(moving[:, None], self.slope(np.clip(t, self.start, self.end)), 0.0)

    def acceleration(self, t: FloatArray) -> FloatArray:
        """Mean joint accelerations (t, n) over `mean_s` around each time, rad/s^2."""
        half = self.mean_s / 2
        return (self.velocity(t + half) - self.velocity(t - half)) / self.mean_s

    def jerk(self, t: FloatArray) -> FloatArray:
        """Mean joint jerks (t, n): changes of the mean acceleration over `mean_s` around each time, rad/s^3."""
        half = self.mean_s / 2
        return (self.acceleration(t + half) - self.acceleration(t - half)) / self.mean_s


def sampled(robot: Robot, positions: FloatArray, dt: float) -> Motion:
    """Joint positions (m, n), rad, every `dt`, s, as a motion of the robot."""
    times = np.arange(len(positions), dtype=np.float64) * dt
    return Motion(times, positions, joint_names=robot.joint_names)


def curve_of(motion: Motion) -> Curve:
    """Join the samples (m >= 2): by quintics where accelerations are given, by cubics where velocities are.

    Of positions alone, by the cubics that playback follows, whose velocities are differences of the neighbours.
    """
    times, positions = motion.times, motion.positions
    step = float(np.median(np.diff(times)))
    if motion.velocities is None:
        path = rest_to_rest(times, positions, times)
        mean = min(step, LONGEST_MEAN)
    elif motion.accelerations is None:
        path, mean = CubicHermiteSpline(times, positions, motion.velocities), min(step, SHORTEST_MEAN)
    else:
        derivatives = np.stack([positions, motion.velocities, motion.accelerations], axis=1)
        path, mean = BPoly.from_derivatives(times, derivatives), min(step, SHORTEST_MEAN)
    return Curve(float(times[0]), float(times[-1]), path, path.derivative(), mean)
