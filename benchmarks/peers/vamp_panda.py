"""Planning for the Panda by VAMP's RRTConnect: what `native` is compared with."""

from __future__ import annotations

from typing import Any

import numpy as np
import vamp

from plancurate.robots.scene import SceneShape
from plancurate.robots.shapes import FloatArray

UPRIGHT = (0.0, 0.0, 0.0)
SAMPLES = (
    10_000  # at most; room for its usual million takes 0.45 ms a call, which its own clock does not count
)


class Vamp:
    """Plans among upright boxes and capsules, with the settings that VAMP's own evaluation has for the Panda."""

    def __init__(self, obstacles: tuple[SceneShape, ...]) -> None:
        self.robot, _, self.planning, self.simplification = vamp.configure_robot_and_planner_with_kwargs(
            "panda", "rrtc"
        )
        self.planning.max_samples = SAMPLES
        self.environment = vamp.Environment()
        for obstacle in obstacles:
            self._add(obstacle)
        self.draws = self.robot.halton()

    def _add(self, obstacle: SceneShape) -> None:
        shape, centre = obstacle.shape, obstacle.shape.pose[:3, 3].tolist()
        if not np.array_equal(shape.pose[:3, :3], np.eye(3)):
            raise ValueError(f"{obstacle.name} does not stand upright")
        if shape.kind == "box":
            self.environment.add_cuboid(vamp.Cuboid(centre, UPRIGHT, shape.size))
        elif shape.kind == "capsule":
            radius, half_length, _ = shape.size
            self.environment.add_capsule(vamp.Cylinder(centre, UPRIGHT, radius, 2 * half_length))
        else:
            raise ValueError(f"{obstacle.name} is a {shape.kind}")

    def is_free(self, q: FloatArray) -> bool:
        """Say whether a state (n,) is free and inside the limits."""
        return bool(self.robot.validate(q.astype(np.float32), self.environment, True))

    def plan(self, start: FloatArray, goal: FloatArray) -> Any:
        """Plan from start (n,) to goal (n,), float32 numbers."""
        return self.robot.rrtc(start, goal, self.environment, self.planning, self.draws)

    def simplify(self, path: Any) -> Any:
        """Shorten and smooth its path."""
        return self.robot.simplify(path, self.environment, self.simplification, self.draws)
