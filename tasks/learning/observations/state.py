"""Where robots are and what they are to do: all that an observation may be made of."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from plancurate import native

if TYPE_CHECKING:
    from plancurate.robots.robot import Robot
    from plancurate.robots.scene import Scene

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class State:
    """States of one robot in b motions through one scene; n is its number of joints."""

    robot: Robot
    scene: Scene
    q: FloatArray
    """(b, n): joint angles, rad or m."""
    tool: FloatArray
    """(b, 4, 4): pose of the tool in the world."""
    target: FloatArray
    """(b, 3): where the tool is due, m."""
    previous_q: FloatArray
    """(b, n): joint angles one step earlier; those of now where the motion begins."""
    goal: FloatArray | None = None
    """(b, n): joint angles that each motion is to end at, where they are known."""

    @property
    def target_offset(self) -> FloatArray:
        """Target minus tool position (b, 3), m."""
        return self.target - self.tool[:, :3, 3]

    def after(self, q: FloatArray) -> State:
        """The states one step later, at joint angles q (b, n)."""
        return state_at(self.robot, self.scene, q, self.target, previous_q=self.q, goal=self.goal)

    def take(self, rows: IntArray) -> State:
        """The states of some of the motions (k,), by their row."""
        return replace(
            self,
            q=self.q[rows],
            tool=self.tool[rows],
            target=self.target[rows],
            previous_q=self.previous_q[rows],
            goal=None if self.goal is None else self.goal[rows],
        )


def state_at(
    robot: Robot,
    scene: Scene,
    q: FloatArray,
    target: FloatArray,
    *,
    previous_q: FloatArray,
    goal: FloatArray | None = None,
) -> State:
    """The state at joint angles q (b, n), with the tool poses computed."""
    tool = native.fk(robot.native, np.ascontiguousarray(q))
    return State(robot, scene, q, tool, target, previous_q, goal)
