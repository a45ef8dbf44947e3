"""In which of several ways a target is reached: classes of goal configurations, and of paths to each.

Two ends are of one goal class when no joint differs by more than `GOAL_RADIUS`: inverse-kinematics solutions, or
cells of the continuum that an orientation tolerance leaves. Two paths to one goal class are of one path class when
the straight lines between their corresponding points are free: then one deforms into the other (visibility
deformation, Jaillet and Simeon 2008). Each path is compared with one representative a class, the shortest path in it,
so the work grows with the number of paths times the few classes that a target has.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial

import numpy as np
import numpy.typing as npt

from plancurate import native
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.robots.shapes import BoolArray, FloatArray
from plancurate.tasks.candidates.polylines import evenly, path_length

IntArray = npt.NDArray[np.intp]

REVISION = 1  # raise when labels change
GOAL_RADIUS = 1.0  # rad (m)
POINTS = 48  # of a path that are compared with another's
RESOLUTION = 0.05  # rad (m) between the checked states of a line from one path to another


def label_paths(robot: Robot, scene: Scene, paths: Sequence[FloatArray], targets: Sequence[int]) -> list[str]:
    """Label each path (m, n), rad, from a common start to the target of that number: "g<k>.p<m>".

    Classes of a target are numbered by their shortest path: g0 holds the target's shortest, g0.p0 as well. The labels
    depend on the paths of the target alone, and on their order only where two are equally long.
    """
    labels = [""] * len(paths)
    for rows in rows_by_target(targets):
        shortest_first = sorted(rows, key=lambda row: path_length(paths[row]))
        goals, ways = classes(robot, scene, np.stack([resampled(paths[row]) for row in shortest_first]))
        for row, goal, way in zip(shortest_first, goals, ways, strict=True):
            labels[row] = f"g{goal}.p{way}"
    return labels


def classes(robot: Robot, scene: Scene, points: FloatArray) -> tuple[IntArray, IntArray]:
    """Goal class (k,) of one target's paths `points` (k, POINTS, n), the shortest first, and path class (k,) in it."""
    goals = grouped(np.arange(len(points)), partial(near_ends, points[:, -1]))
    ways = np.empty_like(goals)
    for goal in range(goals.max() + 1):
        rows = np.flatnonzero(goals == goal)
        ways[rows] = grouped(rows, partial(deform, robot, scene, points))
    return goals, ways


def grouped(rows: IntArray, joins: Callable[[int, IntArray], BoolArray]) -> IntArray:
    """Class of each of the rows (k,): the first without a class founds one, which those of the rest join that may.

    `joins` says of the founder's row and the rest's (m,) which of the rest may join (m,).
    """
    label = np.full(len(rows), -1)
    for number in range(len(rows)):
        left = np.flatnonzero(label < 0)
        if not len(left):
            break
        first, rest = left[0], left[1:]
        label[first] = number
        label[rest[joins(rows[first], rows[rest])]] = number
    return label


def near_ends(ends: FloatArray, one: int, others: IntArray) -> BoolArray:
    """Which of the other paths' `ends` (k, n) are in the goal class of the one's."""
    return np.asarray(np.abs(ends[others] - ends[one]).max(axis=1) <= GOAL_RADIUS)


def deform(robot: Robot, scene: Scene, points: FloatArray, one: int, others: IntArray) -> BoolArray:
    """Which of the other paths (m,) of `points` (k, POINTS, n) straight lines between points turn the one into."""
    to = points[others].reshape(-1, points.shape[2])
    free = native.edge_is_free(
        robot.native, scene.native, np.tile(points[one], (len(others), 1)), to, RESOLUTION
    )
    return np.asarray(free.reshape(-1, POINTS).all(axis=1))


def resampled(path: FloatArray) -> FloatArray:
    """Points (POINTS, n) of a path (m, n), equally spaced by length, both ends included."""
    return evenly(path, POINTS)


def rows_by_target(targets: Sequence[int]) -> Iterable[IntArray]:
    """Numbers of the rows of each target, in order."""
    numbers = np.asarray(targets)
    order = np.argsort(numbers, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(numbers[order])) + 1) if len(order) else []
