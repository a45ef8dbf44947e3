"""From a planned path to a stored trajectory: time it, measure it, play it back."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.metrics import PathMetrics, path_metrics
from plancurate.tasks.candidates.playback import Verification, verify
from plancurate.tasks.candidates.settings import TimingSettings, VerifySettings
from plancurate.tasks.candidates.time_parameterisation import Timed, time_path


@dataclass(frozen=True, eq=False)
class Postprocessed:
    """A trajectory with its metrics and playback, or the reason why there is none; seconds are wall time."""

    timed: Timed
    metrics: PathMetrics | None
    verification: Verification | None
    timing_s: float
    verify_s: float


Postprocess = Callable[[FloatArray, FloatArray], Postprocessed]
"""(path (w, n), target position (3,)) -> trajectory."""
Timing = Callable[[Robot, Scene, FloatArray, TimingSettings], Timed]
"""How a path (w, n) becomes samples."""


def postprocess(
    robot: Robot,
    scene: Scene,
    path: FloatArray,
    target_position: FloatArray,
    timing: TimingSettings,
    playback: VerifySettings,
    timed_by: Timing = time_path,
) -> Postprocessed:
    """Time `path` (w, n), rad, then measure it against `target_position` (3,), m, and play it back.

    Samples that are timed already stay as they are with `timed_by=as_sampled`.
    """
    start = time.perf_counter()
    timed = timed_by(robot, scene, path, timing)
    timing_s = time.perf_counter() - start
    if timed.reason:
        return Postprocessed(timed, None, None, timing_s, 0.0)
    metrics = path_metrics(robot, scene, timed.q, timing.dt, target_position)
    start = time.perf_counter()
    verification = verify(robot, scene, timed.q, timing.dt, playback)
    return Postprocessed(timed, metrics, verification, timing_s, time.perf_counter() - start)
