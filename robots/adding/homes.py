"""Choose a home: the tool in front of the arm, pointing down, with room around it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from plancurate import native
from plancurate.robots.inverse_kinematics import continue_ik
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.robots.shapes import BoolArray, FloatArray

AHEAD = (0.43, 0.5, 0.36, 0.57)  # of the reach from the shoulder's axis
ABOVE = (0.42, 0.35, 0.27, 0.18, 0.05)  # of the reach above the shoulder
STARTS, DRAWS = 512, 20_000
SPREAD = 0.1  # of a joint's range, around the middle, that solutions are looked for from
ROOM = 0.02  # of the reach that home keeps to the floor and between links
ELBOW = 0.15  # rad from a joint's limit
DIGITS = 4


def choose_home(robot: Robot, floor: Scene, scenes: Sequence[Scene]) -> FloatArray | None:
    """Return a free state (n,) with the tool in front, or the best of those drawn; None if none is free.

    Rather one that is free in these scenes too, in which the robot will start from home.
    """
    middle, rng = _middle(robot), np.random.default_rng(0)
    elsewhere = None
    for above in ABOVE:
        for ahead in AHEAD:
            place = robot.shoulder + robot.reach * np.array([ahead, 0.0, above])
            starts = middle + SPREAD * rng.normal(size=(STARTS, robot.dof)) * (robot.upper - robot.lower)
            starts = np.clip(starts, robot.lower, robot.upper)
            found = continue_ik(robot, floor, place, starts, axes=np.tile([0.0, 0.0, -1.0], (STARTS, 1)))
            found = found[_roomy(robot, floor, found)]
            everywhere = found[_free_in(robot, scenes, found)]
            if len(everywhere):
                return _calmest(robot, everywhere)
            if len(found) and elsewhere is None:
                elsewhere = _calmest(robot, found)
    return _best_drawn(robot, floor) if elsewhere is None else elsewhere


def _free_in(robot: Robot, scenes: Sequence[Scene], states: FloatArray) -> BoolArray:
    """Which states (b,n) are free in all the scenes, as they are written."""
    free = np.ones(len(states), dtype=bool)
    for scene in scenes:
        free &= native.is_free(robot.native, scene.native, np.round(states, DIGITS))
    return free


def _roomy(robot: Robot, floor: Scene, states: FloatArray) -> BoolArray:
    """Which states (b,n) keep clear of contacts and joint limits, also as they are written."""
    rounded = np.round(states, DIGITS)
    span = np.minimum(ELBOW, 0.1 * (robot.upper - robot.lower))
    inside = ((rounded >= robot.lower + span) & (rounded <= robot.upper - span)).all(axis=1)
    return np.asarray(
        inside
        & native.is_free(robot.native, floor.native, rounded)
        & (native.clearance(robot.native_without_pairs, floor.native, rounded) > ROOM * robot.reach)
    )


def _middle(robot: Robot) -> FloatArray:
    """Zero where a joint's range holds it well inside, else the range's middle."""
    inner = 0.2 * (robot.upper - robot.lower)
    central = (robot.lower + inner < 0) & (robot.upper - inner > 0)
    return np.where(central, 0.0, (robot.lower + robot.upper) / 2)


def _calmest(robot: Robot, states: FloatArray) -> FloatArray:
    """The state that turns least from the middle."""
    return np.asarray(np.round(states[np.linalg.norm(states - _middle(robot), axis=1).argmin()], DIGITS))


def _best_drawn(robot: Robot, floor: Scene) -> FloatArray | None:
    """Of drawn free states the one whose tool is most in front and points most downwards."""
    states = np.random.default_rng(0).uniform(robot.lower, robot.upper, (DRAWS, robot.dof))
    states = np.round(states, DIGITS)
    free = _roomy(robot, floor, states)
    states = states[free if free.any() else native.is_free(robot.native, floor.native, states)]
    if not len(states):
        return None
    tool = native.fk(robot.native, states)
    place = robot.shoulder + robot.reach * np.array([AHEAD[0], 0.0, ABOVE[0]])
    away = np.linalg.norm(tool[:, :3, 3] - place, axis=1) / robot.reach
    return np.asarray(states[(away + 0.2 * tool[:, 2, 2]).argmin()])
