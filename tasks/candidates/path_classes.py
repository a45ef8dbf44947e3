"""In which of several ways a target is reached: classes of goal configurations, and of paths to each.

Two ends are of one goal class when no joint differs by more than `GOAL_RADIUS`: inverse-kinematics solutions, or
cells of the continuum that an orientation tolerance leaves. Two paths to one goal class are of one path class when
the straight lines between their corresponding points are free: then one deforms into the other (visibility
deformation, Jaillet and Simeon 2008). Each path is compared with one representative a class, the shortest path in it,
so the work grows with the number of paths times the few classes that a target has.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from plancurate import native
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.robots.shapes import FloatArray

REVISION = 1  # raise when labels change
GOAL_RADIUS = 1.0  # rad (m)
POINTS = 48  # of a path that are compared with another's
RESOLUTION = 0.05  # rad (m) between the checked states of a line from one path to another


@dataclass(frozen=True, eq=False)
class Way:
    """A class that has been met, by its shortest path resampled to `points` (POINTS, n)."""

    goal: int
    path: int
    points: FloatArray


def label_paths(robot: Robot, scene: Scene, paths: Sequence[FloatArray], targets: Sequence[int]) -> list[str]:
    """Label each path (m, n), rad, from a common start to the target of that number: "g<k>.p<m>".

    Classes of a target are numbered by their shortest path: g0 holds the target's shortest, g0.p0 as well. The labels
    depend on the paths of the target alone, and on their order only where two are equally long.
    """
    labels = [""] * len(paths)
    for rows in rows_by_target(targets):
        shortest_first = sorted(rows, key=lambda row: length(paths[row]))
        points = {row: resampled(paths[row]) for row in shortest_first}
        ways: list[Way] = []
        for row in shortest_first:
            way = known_way(robot, scene, ways, points[row]) or new_way(ways, points[row])
            labels[row] = f"g{way.goal}.p{way.path}"
    return labels


def known_way(robot: Robot, scene: Scene, ways: list[Way], points: FloatArray) -> Way | None:
    """The class of a path by its `points` (POINTS, n), or None for one that is new."""
    goal = goal_class(ways, points[-1])
    same_goal = (way for way in ways if way.goal == goal)
    return next((way for way in same_goal if deforms(robot, scene, way.points, points)), None)


def new_way(ways: list[Way], points: FloatArray) -> Way:
    """Add the class that `points` (POINTS, n) found and return it."""
    goal = goal_class(ways, points[-1])
    way = Way(goal, sum(way.goal == goal for way in ways), points)
    ways.append(way)
    return way


def goal_class(ways: list[Way], end: FloatArray) -> int:
    """The first goal class whose representative is near the configuration `end` (n,), or the next number."""
    firsts = [way for way in ways if way.path == 0]
    near = (way.goal for way in firsts if np.abs(way.points[-1] - end).max() <= GOAL_RADIUS)
    return next(near, len(firsts))


def deforms(robot: Robot, scene: Scene, a: FloatArray, b: FloatArray) -> bool:
    """Whether all straight lines between corresponding points of two paths (POINTS, n) are free."""
    return bool(native.edge_is_free(robot.native, scene.native, a, b, RESOLUTION).all())


def resampled(path: FloatArray) -> FloatArray:
    """Points (POINTS, n) of a path (m, n), equally spaced by length, both ends included."""
    travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    wanted = np.linspace(0.0, travelled[-1], POINTS)
    return np.stack([np.interp(wanted, travelled, joint) for joint in path.T], axis=1)


def length(path: FloatArray) -> float:
    """Euclidean length of a path (m, n) in joint space."""
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def rows_by_target(targets: Sequence[int]) -> Iterable[npt.NDArray[np.intp]]:
    """Numbers of the rows of each target, in order."""
    numbers = np.asarray(targets)
    order = np.argsort(numbers, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(numbers[order])) + 1) if len(order) else []
