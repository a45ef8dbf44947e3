"""The term that knows a scene by which of a few hundred set configurations collide in it."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from plancurate import native
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.tasks.learning.observations.state import FloatArray, State
from plancurate.tasks.learning.observations.term import observation_term

KEYS = 256
AROUND_RAD = (
    1.2  # of home, within the limits: where the arm works, for most of its whole range lies in the floor
)
SEED = 0


@observation_term("key_collisions", size=lambda robot: KEYS)
def key_collisions(state: State) -> FloatArray:
    """1 for each of 256 set configurations that is not free of obstacles and floor by the scene's margin, else 0."""
    return np.tile(_blocked(state.robot, state.scene), (len(state.q), 1))


@lru_cache(maxsize=1024)
def _blocked(robot: Robot, scene: Scene) -> FloatArray:
    """Which (KEYS,) are not free: the same for every state in a scene, so it is computed once."""
    free = native.is_free(robot.native_without_pairs, scene.native, key_configurations(robot))
    return (~free).astype(np.float64)


def key_configurations(robot: Robot) -> FloatArray:
    """The configurations (KEYS, n): always the same for a robot and its home."""
    lower = np.maximum(robot.lower, robot.home - AROUND_RAD)
    upper = np.minimum(robot.upper, robot.home + AROUND_RAD)
    return np.random.default_rng(SEED).uniform(lower, upper, (KEYS, robot.dof))
