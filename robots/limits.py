"""A robot's planning limits and home: `robot.yaml` laid over the URDF, one checked against the other."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.robots.chain import Chain
from plancurate.robots.robot_file import JointEntry, RobotFile
from plancurate.robots.shapes import FloatArray
from plancurate.robots.urdf import Joint


@dataclass(frozen=True, eq=False)
class Limits:
    """What plans keep to, (n,) each: rad (m) and s; `home` lies within `lower` and `upper`.

    `jerk` is infinite for a joint without such a limit.
    """

    lower: FloatArray
    upper: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    home: FloatArray


def joint_limits(file: Path, content: RobotFile, chain: Chain) -> Limits:
    """Limits in chain order; PlancurateError for an unknown or missing joint or a value beyond the URDF's."""
    names = [joint.name for joint in chain.joints]
    for name in content.joints:
        if name not in names:
            raise PlancurateError(f"{file}: joints: {UnknownNameError('moving joint', name, names)}")
    rows = [_limits_of(file, joint, content.joints.get(joint.name)) for joint in chain.joints]
    return Limits(*np.array(rows).T)


def _limits_of(
    file: Path, joint: Joint, entry: JointEntry | None
) -> tuple[float, float, float, float, float, float]:
    where = f"{file}: joints.{joint.name}"
    if entry is None:
        raise PlancurateError(
            f"{where}: missing; every moving joint needs at least its acceleration and home"
        )
    lower, upper = entry.position or (joint.lower, joint.upper)
    if not np.isfinite([lower, upper]).all():
        raise PlancurateError(
            f"{where}.position: missing; a continuous joint needs a range to plan in, such as [-3.14, 3.14]"
        )
    if not lower < upper:
        raise PlancurateError(f"{where}.position: [{lower:g}, {upper:g}] must rise")
    if lower < joint.lower or upper > joint.upper:
        raise PlancurateError(
            f"{where}.position: [{lower:g}, {upper:g}] must lie within"
            f" the URDF's [{joint.lower:g}, {joint.upper:g}]"
        )
    velocity = joint.velocity if entry.velocity is None else entry.velocity
    if velocity > joint.velocity:
        raise PlancurateError(f"{where}.velocity: {velocity:g} must not exceed the URDF's {joint.velocity:g}")
    if not lower <= entry.home <= upper:
        raise PlancurateError(f"{where}.home: {entry.home:g} must lie within [{lower:g}, {upper:g}]")
    jerk = np.inf if entry.jerk is None else entry.jerk
    return lower, upper, velocity, entry.acceleration, jerk, entry.home
