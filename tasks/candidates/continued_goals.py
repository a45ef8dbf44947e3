"""Goal configurations that continue those of neighbouring targets, so that neighbouring positions are reached alike.

The tool is led from the neighbours' goal to the new position by damped Newton steps, which move the joints as little
as they can; within an orientation tolerance the tool may turn on the way. So a goal depends smoothly on the position,
which no choice among drawn solutions does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.spatial import KDTree

from plancurate import native
from plancurate.robots import continue_ik
from plancurate.robots.damped_newton import newton
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.robots.shapes import BoolArray, FloatArray
from plancurate.tasks.candidates.goals import tool_draws, tool_rotation
from plancurate.tasks.candidates.path_classes import GOAL_RADIUS
from plancurate.tasks.candidates.settings import TargetSettings

NEIGHBOURS = 3
"""Known targets around a position that have a say in its goal."""
NEAR_M = 1e-3
"""Distance within which a known target counts as the position itself, m."""
STARTS = 64
"""Of inverse kinematics around a suggested goal that can't be continued as it is."""
SPREAD = 0.5
"""Of each joint around it for the farthest of these, rad (m)."""
INSIDE_DEG = 0.5
"""A tool that would leave the cone is held so far inside its edge, degrees: the next goal continues from it."""


def suggested_goals(known: FloatArray, goals: FloatArray, positions: FloatArray) -> FloatArray:
    """Goal configurations (t, n) that the targets around positions (t, 3) suggest.

    `known` (g, 3), m, are the positions of targets and `goals` (g, n) their goals. A mean by inverse distance over
    those of the nearest targets whose goals are of one class: of the class that weighs most. So where all differ it
    is the nearest target's, and never a mean of two classes.
    """
    count = min(NEIGHBOURS, len(known))
    distances, nearest = KDTree(known).query(positions, k=range(1, count + 1))
    near = goals[nearest]
    weights = 1 / np.maximum(distances, NEAR_M)
    agree = np.abs(near[:, :, None] - near[:, None]).max(axis=3) <= GOAL_RADIUS
    lead = (agree @ weights[:, :, None])[:, :, 0].argmax(axis=1)
    weights = weights * agree[np.arange(len(positions)), lead]
    return np.asarray(np.einsum("tk,tkn->tn", weights, near) / weights.sum(axis=1, keepdims=True))


def agreeing_goals(
    robot: Robot,
    scene: Scene,
    positions: FloatArray,
    suggested: FloatArray,
    settings: TargetSettings,
    seeds: Sequence[tuple[int, ...]],
    others: Callable[[int], FloatArray],
) -> FloatArray:
    """The goals (t, n) of tool positions (t, 3), m, that agree best with the suggested ones (t, n).

    Each continues the suggestion. Where that ends nowhere or in a collision, it is the free goal nearest to the
    suggestion among those that random starts around it lead to and the goals `others(i)` (k, n) of position i; the
    suggestion itself where there is none. `seeds` has one seed a position.
    """
    goals, found = continued_goals(robot, scene, positions, suggested, settings)
    for i in np.flatnonzero(~found).tolist():
        near = nearby_goals(
            robot, scene, positions[i], suggested[i], settings, np.random.default_rng(seeds[i])
        )
        known = np.concatenate([near, others(i)])
        away = np.linalg.norm(known - suggested[i], axis=1)
        goals[i] = known[away.argmin()] if len(known) else suggested[i]
    return goals


def nearby_goals(
    robot: Robot,
    scene: Scene,
    position: FloatArray,
    suggested: FloatArray,
    settings: TargetSettings,
    rng: np.random.Generator,
) -> FloatArray:
    """Free goals (k, n) of a position (3,), m, that starts nearer and farther around a suggested one (n,) lead to."""
    spread = SPREAD * np.linspace(0, 1, STARTS)[:, None] * rng.uniform(-1, 1, (STARTS, robot.dof))
    starts = np.clip(suggested + spread, robot.lower, robot.upper)
    held = tool_draws(tool_rotation(robot, scene), settings, rng, STARTS)
    return continue_ik(robot, scene, position, starts, **held)


def continued_goals(
    robot: Robot, scene: Scene, positions: FloatArray, starts: FloatArray, settings: TargetSettings
) -> tuple[FloatArray, BoolArray]:
    """Goals (t, n) of tool positions (t, 3), m, within the orientation tolerance, led from starts (t, n), rad.

    Also says which (t,) of them are goals: those that reach their position, within the limits and free.
    """
    rotation = tool_rotation(robot, scene)
    axis = np.tile(rotation[:, 2], (len(positions), 1))
    if settings.orientation == "exact":
        q, reached = newton(robot, starts, positions, rotation)
    elif settings.orientation == "yaw_free":
        q, reached = newton(robot, starts, positions, axes=axis)
    else:
        q, reached = newton(robot, starts, positions)
    if settings.orientation == "cone":
        tool = native.fk(robot.native, q)[:, :3, 2]
        held = into_cone(tool, rotation[:, 2], np.radians(settings.cone_deg))
        out = reached & (held != tool).any(axis=1)
        q[out], reached[out] = newton(robot, q[out], positions[out], axes=held[out])
    inside = ((q >= robot.lower) & (q <= robot.upper)).all(axis=1)
    return q, reached & inside & native.is_free(robot.native, scene.native, q)


def into_cone(directions: FloatArray, axis: FloatArray, half_angle: float) -> FloatArray:
    """Unit vectors (b, 3), those outside the cone around a unit vector (3,) turned to INSIDE_DEG inside its edge."""
    along = directions @ axis
    across = directions - along[:, None] * axis
    length = np.linalg.norm(across, axis=1, keepdims=True)
    edge = max(half_angle - np.radians(INSIDE_DEG), 0.5 * half_angle)
    held = np.cos(edge) * axis + np.sin(edge) * across / np.maximum(length, 1e-12)
    return np.where((along < np.cos(half_angle))[:, None], held, directions)
