"""Clean motions of a generated pool, and faults to put into them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from plancurate import native
from plancurate.robots import Robot, Scene, load_world
from plancurate.tasks.candidates.generate import generate_candidates
from plancurate.tasks.candidates.settings import GenerateSettings
from plancurate.tasks.candidates.targets import sample_targets
from plancurate.tasks.motion.motion import Motion

PLANNERS = ("RRTConnect", "KPIECE1", "PRM")
SETTINGS = GenerateSettings()
DT = SETTINGS.timing.dt


@cache
def world(scene: str) -> tuple[Robot, Scene]:
    """The H2017 in a scene."""
    return load_world("h2017", scene)


@cache
def pool(scene: str, targets: int = 3) -> list[Motion]:
    """Verified candidates in a scene: three runs of three planners to each target."""
    robot, loaded = world(scene)
    drawn = sample_targets(robot, loaded, SETTINGS.targets, 0, targets)
    tables = [generate_candidates(robot, loaded, drawn, planner, SETTINGS)[0] for planner in PLANNERS]
    rows = [row for table in tables for row in table.to_pylist() if row["verified"]]
    return [sampled(robot, np.array(row["q"], dtype=np.float64)) for row in rows]


def sampled(robot: Robot, q: np.ndarray, dt: float = DT) -> Motion:
    """Samples q (m, n) every `dt` s."""
    return Motion(np.arange(len(q)) * dt, q, joint_names=robot.joint_names)


def smooth(robot: Robot, goal: np.ndarray, duration: float, start: np.ndarray | None = None) -> Motion:
    """From home, or another start, to `goal` (n,), with velocity and acceleration zero at both ends."""
    start = robot.home if start is None else start
    t = np.linspace(0, duration, round(duration / DT) + 1)
    s = (t / duration)[:, None]
    return Motion(
        t, start + (10 * s**3 - 15 * s**4 + 6 * s**5) * (goal - start), joint_names=robot.joint_names
    )


def faster(motion: Motion, factor: float) -> Motion:
    """The same way in a shorter time."""
    return replace(motion, times=motion.times / factor)


def edge_through_an_obstacle(robot: Robot, scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Two free states 0.4 rad apart whose straight edge isn't free, found by looking at random ones."""
    rng = np.random.default_rng(0)
    while True:
        a = rng.uniform(robot.lower, robot.upper, (4096, robot.dof))
        b = a + 0.4 * rng.choice([-1, 1], (4096, 1)) * np.eye(robot.dof)[rng.integers(1, 3, 4096)]
        inside = ((b > robot.lower) & (b < robot.upper)).all(axis=1)
        ends = native.is_free(robot.native, scene.native, a) & native.is_free(robot.native, scene.native, b)
        far = native.clearance(robot.native_without_pairs, scene.native, (a + b) / 2) < -0.02
        if (found := np.flatnonzero(inside & ends & far)).size:
            return a[found[0]], b[found[0]]
