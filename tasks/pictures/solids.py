"""What is to be seen: the arm's and the scene's shapes where they are, with their colours."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from plancurate import native
from plancurate.robots import Robot, Scene
from plancurate.robots.shapes import FloatArray, Shape

ARM, JOINT, TOOL = "#eef1f5", "#8fa3bf", "#4c6a92"
OBSTACLE, COLLISION, TOUCHED = "#d9b98a", "#e0261c", "#e8897f"


@dataclass(frozen=True, eq=False)
class Solid:
    """A shape posed in the frame of the robot's base, and its colour."""

    name: str
    shape: Shape
    colour: str


def arm_solids(robot: Robot, q: FloatArray, touching: Collection[str] = ()) -> list[Solid]:
    """The arm's shapes at joint positions q (n,), rad; links that are named as touching are red."""
    frames = np.concatenate([np.eye(4)[None], native.joint_frames(robot.native, q[None])[0]])
    last = len(frames) - 1
    return [
        Solid(
            entry.link,
            Shape(entry.shape.kind, entry.shape.size, frames[entry.frame] @ entry.shape.pose),
            COLLISION
            if entry.link in touching
            else TOOL
            if entry.frame == last
            else (ARM, JOINT)[entry.frame % 2],
        )
        for entry in robot.shapes
    ]


def scene_solids(scene: Scene, touching: Collection[str] = ()) -> list[Solid]:
    """The scene's obstacles; those that are named as touching are light red."""
    return [
        Solid(entry.name, entry.shape, TOUCHED if entry.name in touching else OBSTACLE)
        for entry in scene.shapes
    ]


def tool_path(robot: Robot, q: FloatArray) -> FloatArray:
    """Positions (k, 3) of the tool at joint positions q (k, n), m."""
    return native.fk(robot.native, np.ascontiguousarray(q, dtype=np.float64))[:, :3, 3]
