"""The motion verifier: may this robot run this motion in this scene?

Every check looks between the samples too, at the motion that playback would follow (`motion.curve_of`).
"""

from __future__ import annotations

import numpy as np

from plancurate.errors import PlancurateError
from plancurate.robots import Robot, Scene
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.payload import Payload
from plancurate.tasks.motion import contacts, limits
from plancurate.tasks.motion.motion import Curve, Motion, curve_of
from plancurate.tasks.motion.samples import sample_violations
from plancurate.tasks.motion.settings import MotionSettings
from plancurate.tasks.motion.tracking import tracking
from plancurate.tasks.motion.violations import Verdict, verdict

REVISION = 1
"""Raise it when a motion gets another verdict than before: the keys of studies that verify rollouts hold it."""

LONGEST_S = 3600.0
MOST_PIECES = 1000  # states checked between two control steps of a motion that jumps


def verify_motion(
    robot: Robot,
    scene: Scene,
    motion: Motion,
    settings: MotionSettings = MotionSettings(),
    payload: Payload | None = None,
) -> Verdict:
    """Check a motion from rest to rest; the same input gives the same verdict.

    The payload is that of the settings' playback where no other is given. Samples that are no numbers, out of order
    or of other joints are violations, and the only ones then. Raises PlancurateError for a motion of more than an hour.
    """
    payload = payload or settings.playback.payload
    not_checked = unchecked(robot, motion)
    if wrong := sample_violations(robot, motion):
        return verdict(wrong, not_checked)
    curve = curve_of(motion)
    duration = curve.end - curve.start
    if duration > LONGEST_S:
        raise PlancurateError(f"motion: takes {duration:g} s; at most {LONGEST_S:g} s can be checked")
    t = control_times(motion.times, settings.playback.frequency_hz)
    fine = refined(curve, t, settings.resolution)
    q, judged = curve.position(fine), contacts.judged_scene(scene, settings)
    violations = [
        *limits.position_violations(robot, fine, q),
        *contacts.collisions(robot, judged, fine, q),
    ]
    measured = {"duration s": duration, "samples": float(len(motion.times))}
    for found, numbers in (
        limits.motion_limits(robot, curve, t, settings),
        limits.torque_limits(robot, curve, t, settings, payload),
        contacts.clearance(robot, scene, fine, q, settings),
        tracking(robot, scene, curve, settings.playback, payload),
    ):
        violations += found
        measured |= numbers
    return verdict(violations, not_checked, measured)


def unchecked(robot: Robot, motion: Motion) -> tuple[str, ...]:
    """What nothing can be said about."""
    said = []
    if free := [name for name, jerk in zip(robot.joint_names, robot.jerk, strict=True) if np.isinf(jerk)]:
        said.append(f"jerk of {', '.join(free)}: robot {robot.name} states no limits")
    if motion.joint_names is None:
        said.append("names of the joints: none are given, only a start that is home in another order is seen")
    return tuple(said)


def control_times(times: FloatArray, frequency_hz: float) -> FloatArray:
    """The samples' times (m,) with as many between them as control steps (t,), s."""
    counts = np.ceil(np.diff(times) * frequency_hz).astype(int)
    return split(times, counts)


def refined(curve: Curve, t: FloatArray, resolution: float) -> FloatArray:
    """Times t (t,) with more between them, so that no joint moves farther than the resolution from one to the next."""
    moves = np.abs(np.diff(curve.position(t), axis=0)).max(axis=1)
    return split(t, np.clip(np.ceil(moves / resolution), 1, MOST_PIECES).astype(int))


def split(t: FloatArray, counts: np.ndarray[tuple[int], np.dtype[np.int64]]) -> FloatArray:
    """Times t (t,) with each step from one to the next in so many equal parts."""
    starts, steps = np.repeat(t[:-1], counts), np.repeat(np.diff(t) / counts, counts)
    number = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.append(starts + number * steps, t[-1])
