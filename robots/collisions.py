"""Name what touches what, for messages: slower than asking whether anything does."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from itertools import product

import numpy as np

from plancurate import native
from plancurate.robots.contacts import checked_pairs, scene_shapes
from plancurate.robots.robot import Robot, native_model
from plancurate.robots.scene import Scene, empty_scene
from plancurate.robots.shapes import FloatArray, IntArray, shape_arrays

NO_PAIRS = np.empty((0, 2), dtype=np.int32)
NO_SHAPES = np.empty(0, dtype=np.int32)


def colliding_pairs(robot: Robot, scene: Scene, q: FloatArray) -> list[str]:
    """Name what is not free at state `q` (n,), as "link_4 and table" or "link_4 and ground"; [] if all is."""
    if native.is_free(robot.native, scene.native, q[None])[0]:
        return []
    alone = empty_scene(scene.margin).native
    found = [
        f"{robot.shapes[first].link} and {robot.shapes[second].link}"
        for first, second in checked_pairs(robot.shapes, robot.allowed_contacts)
        if not native.is_free(_pair_alone(robot, first, second), alone, q[None])[0]
    ]
    indices = scene_shapes(robot.shapes, robot.scene_unchecked_links)
    for index, (name, obstacle) in product(indices, _obstacles(scene)):
        if not native.is_free(_shape_alone(robot, index), obstacle, q[None])[0]:
            found.append(f"{robot.shapes[index].link} and {name}")
    return list(dict.fromkeys(found))


def obstacles_in_base(robot: Robot, scene: Scene) -> list[str]:
    """Name what a link that never moves and is not checked against the scene stands in, as "base and crate".

    Such a link stands on the floor, which it may touch. With all else it touches in every state or in none, so that
    one look at the scene stands for a look at each state.
    """
    standing = [
        index
        for index, shape in enumerate(robot.shapes)
        if shape.frame == 0 and shape.link in robot.scene_unchecked_links
    ]
    found = [
        f"{robot.shapes[index].link} and {name}"
        for index, (name, obstacle) in product(standing, _obstacles(replace(scene, ground=None, margin=0.0)))
        if not native.is_free(_shape_alone(robot, index), obstacle, robot.home[None])[0]
    ]
    return list(dict.fromkeys(found))


@lru_cache(maxsize=64)
def _obstacles(scene: Scene) -> list[tuple[str, native.Scene]]:
    """Each part of the scene alone."""
    parts = [
        (entry.name, native.Scene(ground=None, margin=scene.margin, **shape_arrays([entry.shape])))
        for entry in scene.shapes
    ]
    if scene.ground is not None:
        parts.append(("ground", native.Scene(ground=scene.ground, margin=scene.margin, **shape_arrays([]))))
    return parts


@lru_cache(maxsize=4096)
def _pair_alone(robot: Robot, first: int, second: int) -> native.Robot:
    """The robot with only these two of its shapes checked, against each other."""
    return _model(robot, pairs=np.array([[first, second]], dtype=np.int32), against_scene=NO_SHAPES)


@lru_cache(maxsize=4096)
def _shape_alone(robot: Robot, index: int) -> native.Robot:
    """The robot with only this one of its shapes checked, against the scene."""
    return _model(robot, pairs=NO_PAIRS, against_scene=np.array([index], dtype=np.int32))


def _model(robot: Robot, pairs: IntArray, against_scene: IntArray) -> native.Robot:
    return native_model(
        robot.chain,
        robot.shapes,
        tool=np.eye(4),
        lower=robot.lower,
        upper=robot.upper,
        pairs=pairs,
        scene_shapes=against_scene,
    )
