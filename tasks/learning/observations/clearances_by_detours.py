"""The term that feels along detours: ways to the goal over one point aside, in set directions of joint space.

Where the straight way is blocked it tells which first moves open a way; which of these to take is left to the policy.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from plancurate import native
from plancurate.robots.robot import Robot
from plancurate.tasks.learning.observations.clearances import RANGE_M
from plancurate.tasks.learning.observations.state import FloatArray, State
from plancurate.tasks.learning.observations.term import observation_term

DRAWN = 32  # directions beside one to either side of each joint
SEED = 0
ASIDE_RAD = 0.6  # how far off the point is
TO_POINT = np.array([0.5, 1.0])  # where on the line to the point is felt, shares of it
TO_GOAL = np.arange(1, 6) / 6  # ditto from the point to the goal; the goal itself is the same for all
AT_ONCE = 128  # states, so that their ways fit into the processor's cache


@observation_term("clearances_by_detours", size=lambda robot: DRAWN + 2 * robot.dof, needs_goal=True)
def clearances_by_detours(state: State) -> FloatArray:
    """Least clearance on each of a few dozen ways to the goal over a point 0.6 rad (m) aside, m, at most 0.3."""
    assert state.goal is not None  # observe sees to that
    parts = range(0, max(1, len(state.q)), AT_ONCE)
    found = [_least(state, state.q[k : k + AT_ONCE], state.goal[k : k + AT_ONCE]) for k in parts]
    return np.concatenate(found)


def _least(state: State, q: FloatArray, goal: FloatArray) -> FloatArray:
    """Least clearances (b, k) of the ways from q (b, n) to goal (b, n)."""
    aside = points_aside(state.robot, q)[:, :, None]
    there = q[:, None, None] + TO_POINT[:, None] * (aside - q[:, None, None])
    onward = aside + TO_GOAL[:, None] * (goal[:, None, None] - aside)
    ways = np.concatenate([there, onward], axis=2)
    b, k, points, n = ways.shape
    robot, scene = state.robot.native_without_pairs, state.scene.native
    return native.way_clearance(robot, scene, ways.reshape(b * k, points, n), RANGE_M).reshape(b, k)


def points_aside(robot: Robot, q: FloatArray) -> FloatArray:
    """The points (b, k, n) that the ways from q (b, n) lead over, inside the joints' limits."""
    return np.clip(q[:, None] + ASIDE_RAD * directions(robot.dof), robot.lower, robot.upper)


@cache
def directions(dof: int) -> FloatArray:
    """Unit vectors (k, n): either way along each joint, and drawn ones that are always the same."""
    drawn = np.random.default_rng(SEED).normal(size=(DRAWN, dof))
    unit = drawn / np.linalg.norm(drawn, axis=1, keepdims=True)
    return np.concatenate([np.eye(dof), -np.eye(dof), unit])
