"""Collision-free joint solutions of a tool pose, a tool position or one with a direction, by multi-start."""

from __future__ import annotations

from itertools import product

import numpy as np

from plancurate import native
from plancurate.robots.damped_newton import converge, tool_jacobian
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.robots.shapes import BoolArray, FloatArray

STARTS = 128  # a round; a solution of the H2017 draws 3 to 18 % of them
ROUNDS = 4  # at most; another follows while some solution was met only once
SAME = 1e-3  # rad or m; isolated solutions nearer than this are one
SEPARATION = 0.5  # rad or m between the representatives of a continuum
SINGULAR = 1e-3  # smallest singular value below which a solution is part of a continuum
LIMIT_SLACK = 1e-9  # rad or m; rounding at a limit does not cost a solution


def solve_ik(
    robot: Robot,
    scene: Scene,
    position: FloatArray,
    rotation: FloatArray | None,
    rng: np.random.Generator,
    separation: float = SEPARATION,
) -> FloatArray:
    """Return the free solutions (k,n) within the planning limits, sorted lexicographically; (0,n) for none.

    `position` (3,) in m and `rotation` (3,3), or None for any, describe the tool in the base frame. Where
    solutions form a continuum (no rotation, more joints than needed, a singular pose), the result holds
    representatives that differ by at least `separation` (rad or m) in some joint. Every solution meets its
    target to 1e-6 m and rad.
    """
    reached = _multi_start(robot, position, rotation, rng)
    candidates = _turns_within_limits(robot, reached)
    if len(candidates):
        candidates = candidates[native.is_free(robot.native, scene.native, candidates)]
    isolated = _isolated(robot, candidates, rotation)
    continuum = candidates[~isolated]
    found = np.concatenate([candidates[isolated], representatives(continuum, separation)])
    return np.asarray(found[np.lexsort(found.T[::-1])])


def draw_ik(
    robot: Robot,
    scene: Scene,
    position: FloatArray,
    rng: np.random.Generator,
    starts: int,
    rotation: FloatArray | None = None,
    axes: FloatArray | None = None,
) -> FloatArray:
    """Return the free solutions (k,n) within the planning limits that random starts lead to, in random order.

    The tool is held to `position` (3,), m, and to a `rotation` (3,3), or by its z axis to the directions `axes`
    (starts,3), one a start, or to neither. A solution may come several times. Targets are met to 1e-6 m and rad.
    """
    drawn = rng.uniform(robot.lower, robot.upper, (starts, robot.dof))
    return np.asarray(rng.permutation(continue_ik(robot, scene, position, drawn, rotation, axes)))


def continue_ik(
    robot: Robot,
    scene: Scene,
    position: FloatArray,
    starts: FloatArray,
    rotation: FloatArray | None = None,
    axes: FloatArray | None = None,
) -> FloatArray:
    """Return the free solutions (k,n) within the planning limits that `starts` (s,n), rad, lead to.

    The tool is held as `draw_ik` says; `axes` is one a start. What differs by whole turns counts as well.
    """
    states = _turns_within_limits(robot, converge(robot, starts, position, rotation, axes))
    return states[native.is_free(robot.native, scene.native, states)]


def representatives(q: FloatArray, separation: float = SEPARATION) -> FloatArray:
    """Those of the states `q` (b,n), the first first, that differ from all before by `separation` in some joint."""
    return q[_distinct(q, separation, np.zeros(q.shape[1], dtype=bool))[0]]


def _multi_start(
    robot: Robot, position: FloatArray, rotation: FloatArray | None, rng: np.random.Generator
) -> FloatArray:
    """Distinct solutions (c,n), limits and collisions aside, until each isolated one was met twice."""
    solutions, counts = np.empty((0, robot.dof)), np.empty(0, dtype=np.int64)
    for _ in range(ROUNDS):
        starts = rng.uniform(robot.lower, robot.upper, (STARTS, robot.dof))
        reached = np.concatenate([solutions, converge(robot, starts, position, rotation)])
        kept, met = _distinct(reached, SAME, ~robot.chain.prismatic)
        met[: len(counts)] += counts - 1
        solutions, counts = reached[kept], met
        if not (counts[_isolated(robot, solutions, rotation)] == 1).any():
            break
    return solutions


def _isolated(robot: Robot, q: FloatArray, rotation: FloatArray | None) -> BoolArray:
    """Which solutions (b,) have no others in their neighbourhood."""
    rows = 3 if rotation is None else 6
    if robot.dof > rows or not len(q):
        return np.zeros(len(q), dtype=bool)
    jacobian = tool_jacobian(robot, q)[1][:, :rows]
    return np.asarray(np.linalg.svd(jacobian, compute_uv=False)[:, -1] > SINGULAR)


def _turns_within_limits(robot: Robot, q: FloatArray) -> FloatArray:
    """All states (c,n) within the planning limits that differ from those of `q` (b,n) by whole turns."""
    turning = ~robot.chain.prismatic
    lowest = robot.lower - LIMIT_SLACK
    first = np.where(turning, np.mod(q - lowest, 2 * np.pi) + lowest, q)
    further = np.where(turning, np.floor((robot.upper - robot.lower) / (2 * np.pi)), 0.0).astype(int)
    turns = np.array(list(product(*(range(count + 1) for count in further))))
    states = (first[:, None] + 2 * np.pi * turns[None]).reshape(-1, robot.dof)
    inside = ((states >= lowest) & (states <= robot.upper + LIMIT_SLACK)).all(axis=1)
    return np.clip(states[inside], robot.lower, robot.upper)


def _distinct(q: FloatArray, distance: float, turning: BoolArray) -> tuple[list[int], np.ndarray]:
    """Indices of states, first come first kept, that differ by `distance` in some joint; how many each means.

    Joints marked in `turning` (n,) are compared up to whole turns.
    """
    kept: list[int] = []
    counts: list[int] = []
    for index, state in enumerate(q):
        apart = np.abs(q[kept] - state)
        apart = np.where(turning, np.abs(np.mod(apart + np.pi, 2 * np.pi) - np.pi), apart).max(axis=1)
        if kept and apart.min() < distance:
            counts[int(apart.argmin())] += 1
        else:
            kept.append(index)
            counts.append(1)
    return kept, np.array(counts, dtype=np.int64)
