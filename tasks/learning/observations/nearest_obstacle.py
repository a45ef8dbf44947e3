"""The term that says of each link how far off the nearest obstacle is, and in which direction.

The kernel gives distances but no nearest points. Where obstacles moved a little along an axis are farther off by so
much, their nearest point lies that way: differences of distances along the three axes are the direction.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from plancurate import native
from plancurate.robots.contacts import scene_shapes
from plancurate.robots.robot import Robot, native_model
from plancurate.robots.scene import Scene, SceneShape, native_scene
from plancurate.tasks.learning.observations.clearances import RANGE_M
from plancurate.tasks.learning.observations.state import FloatArray, State
from plancurate.tasks.learning.observations.term import observation_term

SHIFT_M = (
    5e-3  # of the obstacles, to either side; the kernel's distances are good to a hundredth of a millimetre
)
NO_PAIRS = np.empty((0, 2), dtype=np.int32)


@lru_cache(maxsize=64)
def moving_links(robot: Robot) -> tuple[native.Robot, ...]:
    """The robot with only those shapes checked against the scene that move with one joint, for each such joint."""
    checked = scene_shapes(robot.shapes, robot.scene_unchecked_links)
    frames = np.array([robot.shapes[i].frame for i in checked])
    return tuple(
        native_model(
            robot.chain,
            robot.shapes,
            tool=np.eye(4),
            lower=robot.lower,
            upper=robot.upper,
            pairs=NO_PAIRS,
            scene_shapes=checked[frames == frame],
        )
        for frame in sorted(set(frames[frames > 0].tolist()))
    )


@observation_term("nearest_obstacle", size=lambda robot: 4 * len(moving_links(robot)))
def nearest_obstacle(state: State) -> FloatArray:
    """Distance (m, at most 0.3) from each moving link to the nearest obstacle or floor, and the unit direction to it.

    A direction is zero where the link touches, or where nothing is within 0.3 m. Links that are rigid to each other
    count as one.
    """
    q = np.ascontiguousarray(state.q)
    here, *there = (
        np.stack([_distances(link, scene, q) for link in moving_links(state.robot)], axis=1)
        for scene in (state.scene.native, *_shifted(state.scene))
    )
    slope = np.stack([there[axis] - there[axis + 3] for axis in range(3)], axis=2)
    size = np.linalg.norm(slope, axis=2, keepdims=True)
    seen = ((here > 0) & (here < RANGE_M))[:, :, None] & (size > 0)
    direction = np.divide(slope, size, out=np.zeros_like(slope), where=seen)
    near = np.minimum(here, RANGE_M)[:, :, None]
    return np.concatenate([near, direction], axis=2).reshape(len(q), -1)


def _distances(link: native.Robot, scene: native.Scene, q: FloatArray) -> FloatArray:
    """Distances (b,) of a link at joint angles q (b, n), m: 0 at contact, and finite where there is no obstacle."""
    return np.clip(native.clearance(link, scene, q), 0.0, RANGE_M + SHIFT_M)


@lru_cache(maxsize=64)
def _shifted(scene: Scene) -> tuple[native.Scene, ...]:
    """The scene with all obstacles moved along x, y and z, forward and then back."""
    return tuple(_moved(scene, sign * SHIFT_M * np.eye(3)[axis]) for sign in (1, -1) for axis in range(3))


def _moved(scene: Scene, by: FloatArray) -> native.Scene:
    """The kernel's scene with obstacles and floor moved by (3,), m."""
    step = np.zeros((4, 4))
    step[:3, 3] = by
    shapes = tuple(
        SceneShape(entry.name, replace(entry.shape, pose=entry.shape.pose + step)) for entry in scene.shapes
    )
    ground = None if scene.ground is None else scene.ground + float(by[2])
    return native_scene(shapes, ground, scene.margin)
