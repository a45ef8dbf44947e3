"""Whether a motion keeps the limits of each joint, at its samples and between them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from plancurate.robots.robot import Robot
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.inverse_dynamics import joint_torques
from plancurate.tasks.candidates.limits import POSITION_TOLERANCE
from plancurate.tasks.candidates.payload import Payload
from plancurate.tasks.motion.motion import Curve
from plancurate.tasks.motion.settings import MotionSettings
from plancurate.tasks.motion.violations import Check, Violation

Found = tuple[list[Violation], dict[str, float]]
"""Violations, and what was measured."""


def position_violations(robot: Robot, t: FloatArray, q: FloatArray) -> Iterator[Violation]:
    """The joints that leave their range in states q (t, n) at times t (t,)."""
    beyond = np.maximum(robot.lower - q, q - robot.upper)
    for joint in np.flatnonzero((beyond > POSITION_TOLERANCE).any(axis=0)).tolist():
        first, worst = int((beyond[:, joint] > POSITION_TOLERANCE).argmax()), int(beyond[:, joint].argmax())
        value = float(q[worst, joint])
        limit = float(robot.lower[joint] if value < robot.lower[joint] else robot.upper[joint])
        unit, name = unit_of(robot, joint), robot.joint_names[joint]
        message = (
            f"{name} leaves its position limits, up to {value:.4g} {unit} where {limit:.4g} is the limit "
            f"({beyond[worst, joint]:.3g} {unit} beyond)"
        )
        yield Violation("position", float(t[first]), name, message, value, limit, unit)


def motion_limits(robot: Robot, curve: Curve, t: FloatArray, settings: MotionSettings) -> Found:
    """Velocity, acceleration and, where the robot has limits, jerk at times t (t,)."""
    loose = settings.acceleration_tolerance
    checks: list[tuple[Check, FloatArray, FloatArray, float, str]] = [
        ("velocity", curve.velocity(t), robot.velocity, settings.velocity_tolerance, "/s"),
        ("acceleration", curve.acceleration(t), robot.acceleration, loose, "/s^2"),
    ]
    if np.isfinite(robot.jerk).any():
        checks.append(("jerk", curve.jerk(t), robot.jerk, loose, "/s^3"))
    violations: list[Violation] = []
    measured: dict[str, float] = {}
    for check, values, limits, tolerance, per in checks:
        units = [f"{unit_of(robot, joint)}{per}" for joint in range(robot.dof)]
        violations += excesses(robot, check, t, np.abs(values), limits, tolerance, units)
        measured[f"{check} share"] = float((np.abs(values) / limits).max())
    return violations, measured


def torque_limits(
    robot: Robot, curve: Curve, t: FloatArray, settings: MotionSettings, payload: Payload | None
) -> Found:
    """Torques by inverse dynamics at times t (t,), against the efforts in the URDF."""
    torques = np.abs(
        joint_torques(robot, curve.position(t), curve.velocity(t), curve.acceleration(t), payload)
    )
    units = ["N" if sliding else "N m" for sliding in robot.chain.prismatic]
    tolerance = settings.torque_tolerance
    violations = list(excesses(robot, "torque", t, torques, robot.effort, tolerance, units))
    return violations, {"torque share": float((torques / robot.effort).max())}


def excesses(
    robot: Robot,
    check: Check,
    t: FloatArray,
    values: FloatArray,
    limits: FloatArray,
    tolerance: float,
    units: list[str],
) -> Iterator[Violation]:
    """The joints whose values (t, n), not negative, exceed their limit (n,) by more than the tolerance."""
    over = ~(values <= limits * (1 + tolerance))
    for joint in np.flatnonzero(over.any(axis=0)).tolist():
        name, worst, limit = robot.joint_names[joint], float(values[:, joint].max()), float(limits[joint])
        message = (
            f"{name} exceeds its {check} limit, up to {worst:.4g} {units[joint]} where {limit:.4g} is allowed "
            f"({worst / limit:.2f} times)"
        )
        first = float(t[over[:, joint].argmax()])
        yield Violation(check, first, name, message, worst, limit, units[joint])


def unit_of(robot: Robot, joint: int) -> str:
    """Unit of a joint's position."""
    return "m" if robot.chain.prismatic[joint] else "rad"
