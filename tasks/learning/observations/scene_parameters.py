"""The term that tells where a scene's obstacles are and how large."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from plancurate.robots.scene import Scene
from plancurate.robots.shapes import Shape
from plancurate.tasks.learning.observations.state import FloatArray, State
from plancurate.tasks.learning.observations.term import observation_term

OBSTACLES = 12  # told of; the farthest from the base are left out where there are more


@observation_term("scene_parameters", size=lambda robot: 6 * OBSTACLES)
def scene_parameters(state: State) -> FloatArray:
    """Centre and half extents (m, along the base's axes) of the 12 obstacles nearest to the base, nearest first.

    Zeros stand for those that a scene does not have. The floor is not told.
    """
    return np.tile(_parameters(state.scene), (len(state.q), 1))


@lru_cache(maxsize=1024)
def _parameters(scene: Scene) -> FloatArray:
    """What is told (6 * OBSTACLES,) of a scene."""
    shapes = sorted(
        (entry.shape for entry in scene.shapes), key=lambda shape: np.linalg.norm(shape.pose[:3, 3])
    )
    rows = [np.concatenate([shape.pose[:3, 3], half_extents(shape)]) for shape in shapes[:OBSTACLES]]
    told = np.concatenate([np.empty(0), *rows])
    return np.pad(told, (0, 6 * OBSTACLES - len(told)))


def half_extents(shape: Shape) -> FloatArray:
    """Half the size (3,), m, of the smallest box along the frame's axes that holds a shape."""
    turn = np.abs(shape.pose[:3, :3])
    radius, half_length, _ = shape.size
    if shape.kind == "box":
        return np.asarray(turn @ shape.size)
    if shape.kind == "sphere":
        return np.full(3, radius)
    along = turn[:, 2]
    round_part = radius if shape.kind == "capsule" else radius * np.sqrt(np.maximum(1 - along**2, 0))
    return np.asarray(along * half_length + round_part)
