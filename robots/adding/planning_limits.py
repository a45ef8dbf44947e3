"""What plans of an added robot keep to: each joint's range, speed and acceleration."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from plancurate.robots.adding.findings import Findings
from plancurate.robots.adding.source import TURNING, SourceJoint

FASTEST = 3.2  # rad/s that plans use where a file allows more
SECONDS_TO_SPEED = 1.0  # from rest: what the acceleration follows from, for a URDF has none
WHOLE_TURN = 6.2832  # rad either way that plans use of a joint without limits


@dataclass(frozen=True)
class MovingJoint:
    """The URDF's limits of a joint that moves (infinite for a continuous one), and those of plans."""

    source: SourceJoint
    lower: float
    upper: float
    velocity: float
    effort: float
    position: tuple[float, float]
    plan_velocity: float

    @property
    def acceleration(self) -> float:
        """What plans accelerate by, rad/s2 (m/s2)."""
        return self.plan_velocity / SECONDS_TO_SPEED


def planning_limits(
    joints: Sequence[SourceJoint], velocity: float | None, effort: float | None, findings: Findings
) -> list[MovingJoint]:
    """Read the limits of the joints; `velocity` and `effort` are for those whose file has none above zero."""
    return [_limits_of(joint, velocity, effort, findings) for joint in joints]


def _limits_of(
    joint: SourceJoint, velocity: float | None, effort: float | None, findings: Findings
) -> MovingJoint:
    lower, upper = _range(joint, findings)
    speed = _positive(joint, "velocity", velocity, findings)
    force = _positive(joint, "effort", effort, findings)
    position = _position(joint, lower, upper, findings)
    plan = speed
    if joint.type in TURNING and speed > FASTEST:
        plan = FASTEST
        findings.notes.append(f"joint '{joint.name}' may turn at {speed:g} rad/s; plans use {FASTEST:g}")
    return MovingJoint(joint, lower, upper, speed, force, position, plan)


def _range(joint: SourceJoint, findings: Findings) -> tuple[float, float]:
    if joint.type == "continuous":
        return -math.inf, math.inf
    lower, upper = joint.limit.get("lower", 0.0), joint.limit.get("upper", 0.0)
    if lower < upper:
        return lower, upper
    remedy = (
        "type continuous, if it turns without end"
        if joint.type in TURNING
        else f"--joint {joint.name}={lower:g}, to hold it"
    )
    findings.problems.append(
        f"joint '{joint.name}': its limit lower={lower:g} must be below upper={upper:g}; write its range, or {remedy}"
    )
    return -1.0, 1.0


def _positive(joint: SourceJoint, name: str, given: float | None, findings: Findings) -> float:
    value = joint.limit.get(name, 0.0)
    if value > 0.0:
        return value
    if given is None:
        findings.problems.append(
            f"joint '{joint.name}': its limit has no {name} above zero; --{name} VALUE is taken for such joints"
        )
        return 1.0
    findings.notes.append(f"joint '{joint.name}' has no {name} limit; --{name} {given:g} is taken")
    return given


def _position(joint: SourceJoint, lower: float, upper: float, findings: Findings) -> tuple[float, float]:
    """The range of plans: the file's soft limits where it has them, whole turns where it has none."""
    low, high = joint.limit.get("soft_lower_limit", lower), joint.limit.get("soft_upper_limit", upper)
    low, high = (max(low, lower), min(high, upper)) if low < high else (lower, upper)
    if math.isinf(low) or math.isinf(high):
        findings.notes.append(
            f"joint '{joint.name}' turns without end; plans use {WHOLE_TURN} rad either way"
        )
        return -WHOLE_TURN, WHOLE_TURN
    return low, high
