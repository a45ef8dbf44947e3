"""Whether the samples of a motion are numbers, in order of time, of the robot's joints in their order."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from plancurate.robots.robot import Robot
from plancurate.tasks.motion.motion import Motion
from plancurate.tasks.motion.violations import Violation

SAME_START = 1e-3  # rad (m): how near to a permuted home a first sample counts as one


def sample_violations(robot: Robot, motion: Motion) -> list[Violation]:
    """Everything that makes the motion unreadable; no other check makes sense then."""
    if wrong := shape_violation(robot, motion):
        return [wrong]
    return [*order_violations(robot, motion), *number_violations(robot, motion), *time_violations(motion)]


def shape_violation(robot: Robot, motion: Motion) -> Violation | None:
    """One where the samples are too few, or not of as many joints as the robot has."""
    wanted = (len(motion.times), robot.dof)
    for name in ("positions", "velocities", "accelerations"):
        values = getattr(motion, name)
        if values is not None and values.shape != wanted:
            message = f"{name} have shape {values.shape}; {wanted} is right for {robot.dof} joints"
            return Violation("shape", 0.0, "", message)
    if len(motion.times) < 2:
        return Violation("shape", 0.0, "", f"{len(motion.times)} samples; at least 2 make a motion")
    return None


def order_violations(robot: Robot, motion: Motion) -> Iterator[Violation]:
    """Joints that are not the robot's, or not in its order; without names, a start that is home in another order."""
    start = float(motion.times[0])
    if motion.joint_names is not None:
        if motion.joint_names != robot.joint_names:
            found, right = ", ".join(motion.joint_names), ", ".join(robot.joint_names)
            yield Violation("joint order", start, "", f"the joints are {found}; {robot.name} has {right}")
        return
    first = motion.positions[0]
    at_home = np.abs(first - robot.home) <= SAME_START
    if not at_home.all() and np.abs(np.sort(first) - np.sort(robot.home)).max() <= SAME_START:
        moved = ", ".join(np.array(robot.joint_names)[~at_home])
        message = f"the start is home with {moved} exchanged, so the joints seem to be in another order"
        yield Violation("joint order", start, moved, message)


def number_violations(robot: Robot, motion: Motion) -> Iterator[Violation]:
    """The first value of each kind that is no finite number."""
    if not np.isfinite(motion.times).all():
        sample = int(np.flatnonzero(~np.isfinite(motion.times))[0])
        before = float(motion.times[sample - 1]) if sample else 0.0
        yield Violation("finite", before, "", f"the time of sample {sample} is {motion.times[sample]}")
    for name in ("positions", "velocities", "accelerations"):
        values = getattr(motion, name)
        if values is None or np.isfinite(values).all():
            continue
        sample, joint = np.argwhere(~np.isfinite(values))[0]
        value, where = values[sample, joint], robot.joint_names[joint]
        time = float(np.nan_to_num(motion.times[sample]))
        yield Violation("finite", time, where, f"{name} of {where} in sample {sample} are {value}")


def time_violations(motion: Motion) -> Iterator[Violation]:
    """The first time that does not follow the one before."""
    back = np.flatnonzero(np.diff(motion.times) <= 0)
    if len(back):
        before, after = motion.times[back[0]], motion.times[back[0] + 1]
        message = f"sample {back[0] + 1} at {after:g} s does not follow the one at {before:g} s"
        yield Violation("times", float(before), "", message)
