"""Whether the arm follows a motion when PyBullet plays it."""

from __future__ import annotations

import numpy as np

from plancurate import native
from plancurate.robots import Robot, Scene
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.payload import Payload
from plancurate.tasks.candidates.playback import FULL_EFFORT, Playback, follow, references
from plancurate.tasks.candidates.settings import VerifySettings
from plancurate.tasks.motion.limits import Found
from plancurate.tasks.motion.motion import Curve
from plancurate.tasks.motion.violations import Violation


def tracking(
    robot: Robot, scene: Scene, curve: Curve, settings: VerifySettings, payload: Payload | None
) -> Found:
    """Play the motion with the payload and judge it by the thresholds of playback."""
    wanted = references(curve.position, curve.start, curve.end, settings)
    played = follow(robot, scene, wanted, settings, payload)
    t = curve.start + np.arange(1, len(wanted)) / settings.frequency_hz
    errors = np.abs(played.q - played.wanted)
    tools = native.fk(robot.native, np.stack([played.q[-1], played.wanted[-1]]))[:, :3, 3]
    final = float(np.linalg.norm(tools[0] - tools[1]))
    full = np.abs(played.torque) >= FULL_EFFORT * robot.effort
    violations = [
        *touches(played, t),
        *lags(robot, errors, t, settings.max_tracking_error_rad),
        *misses(final, t, settings.max_final_error_m),
        *saturations(robot, full, t, settings.max_saturated_share),
    ]
    measured = {"tracking error rad": float(errors.max()), "final error m": final}
    return violations, measured | {"saturated share": float(full.mean())}


def touches(played: Playback, t: FloatArray) -> list[Violation]:
    """The first contact in physics, which may be later than where the motion itself collides."""
    for when, touching in zip(t, played.touching, strict=True):
        if touching:
            first = touching[0]
            message = f"played back, {first.first} touches {first.second}"
            pair = f"{first.first} and {first.second}"
            return [Violation("contact", float(when), pair, message, -first.distance, 0.0, "m")]
    return []


def lags(robot: Robot, errors: FloatArray, t: FloatArray, limit: float) -> list[Violation]:
    """The joint that is farthest from where it should be; a simulation that blew up is nowhere."""
    over = ~(errors <= limit)
    if not over.any():
        return []
    first = int(over.any(axis=1).argmax())
    joint = int(over[first].argmax())
    worst, name = float(errors[:, joint].max()), robot.joint_names[joint]
    message = f"played back, {name} is up to {worst:.4g} rad from where it should be, {limit:g} is allowed"
    return [Violation("tracking", float(t[first]), name, message, worst, limit, "rad")]


def misses(final: float, t: FloatArray, limit: float) -> list[Violation]:
    """A tool that does not end where it should."""
    if final <= limit:
        return []
    message = f"played back, the tool ends {final:.4f} m from its goal, {limit:g} m is allowed"
    return [Violation("tracking", float(t[-1]), "tool", message, final, limit, "m")]


def saturations(
    robot: Robot, full: np.ndarray[tuple[int, int], np.dtype[np.bool_]], t: FloatArray, limit: float
) -> list[Violation]:
    """Joints that are at their effort limit for too long; named is the first that gets there."""
    share = float(full.mean())
    if share <= limit:
        return []
    first = int(full.any(axis=1).argmax())
    name = robot.joint_names[int(full[first].argmax())]
    message = (
        f"played back, joints are at their effort limit for {share:.3f} of all steps, {limit:g} is allowed"
    )
    return [Violation("saturation", float(t[first]), name, message, share, limit, "")]
