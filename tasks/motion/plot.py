"""A picture of a motion: each joint's position, and what is wrong with it where."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from plancurate.errors import PlancurateError
from plancurate.robots import Robot
from plancurate.tasks.motion.motion import Motion, curve_of
from plancurate.tasks.motion.samples import sample_violations
from plancurate.tasks.motion.violations import Verdict

POINTS = 1000  # of a curve
LEAST_SPAN = 0.02  # rad (m): a joint that rests is a line, not noise
FIRST, LATER, LIMIT = "#c0392b", "#e67e22", "#999999"


def plot_motion(file: Path, robot: Robot, motion: Motion, verdict: Verdict) -> None:
    """Write a PNG of the joints over time, violations marked where they begin, the first of them in red."""
    if file.suffix.lower() != ".png":
        raise PlancurateError(f"{file}: the picture's name must end with .png")
    figure = motion_figure(robot, motion, verdict)
    figure.savefig(file, dpi=100)


def motion_figure(robot: Robot, motion: Motion, verdict: Verdict) -> Figure:
    """The same as a figure."""
    joints = motion.positions.shape[1]
    names = robot.joint_names if joints == robot.dof else [f"column {i + 1}" for i in range(joints)]
    figure = Figure(figsize=(9, 1.2 + 1.4 * joints), layout="constrained")
    axes = figure.subplots(joints, 1, sharex=True, squeeze=False)[:, 0]
    readable = not sample_violations(robot, motion)
    for joint, (name, axis) in enumerate(zip(names, axes, strict=True)):
        axis.set_ylabel(name)
        axis.plot(motion.times, motion.positions[:, joint], ".", ms=3, color="#1f4e79")
        if readable:
            draw_joint(axis, robot, motion, joint)
        mark(axis, name, verdict)
    axes[-1].set_xlabel("time, s")
    figure.suptitle(
        "PASS" if verdict.first is None else f"FAIL: {verdict.first.sentence}", wrap=True, fontsize=10
    )
    return figure


def draw_joint(axis: Axes, robot: Robot, motion: Motion, joint: int) -> None:
    """The motion between the samples, and the limits where it comes near them."""
    curve = curve_of(motion)
    t = np.linspace(curve.start, curve.end, POINTS)
    position = curve.position(t)[:, joint]
    axis.plot(t, position, lw=1, color="#1f4e79")
    low, high = axis.get_ylim()
    if high - low < LEAST_SPAN:
        low, high = (low + high - LEAST_SPAN) / 2, (low + high + LEAST_SPAN) / 2
        axis.set_ylim(low, high)
    for limit in (robot.lower[joint], robot.upper[joint]):
        if low <= limit <= high:
            axis.axhline(limit, color=LIMIT, lw=0.8, ls="--")


def mark(axis: Axes, joint: str, verdict: Verdict) -> None:
    """Lines where violations of this joint, or of the whole arm, begin."""
    for violation in reversed(verdict.violations):
        of_a_joint = violation.check in ("position", "velocity", "acceleration", "jerk", "torque", "tracking")
        if of_a_joint and violation.where != joint:
            continue
        first = violation is verdict.first
        axis.axvline(violation.time_s, color=FIRST if first else LATER, lw=1.6 if first else 0.8)
        axis.annotate(
            violation.check, (violation.time_s, 0.98), xycoords=("data", "axes fraction"), rotation=90, va="top",
            ha="right", fontsize=7, color=FIRST if first else LATER,
        )  # fmt: skip
