"""Compiled core: kinematics, collision checking and planning. Arrays are float64 and C-contiguous.

n joints, b states. The interpreter lock is released while the functions compute; Robot and Scene never change, so
threads may share them. Wrong shapes, kinds, indices and non-finite numbers raise ValueError.
"""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]
BoolArray = NDArray[np.bool_]

class Robot:
    """A chain of joints with primitive shapes on its frames."""

    def __init__(
        self,
        *,
        origins: FloatArray,
        axes: FloatArray,
        prismatic: BoolArray,
        tool: FloatArray,
        lower: FloatArray,
        upper: FloatArray,
        shape_kinds: IntArray,
        shape_frames: IntArray,
        shape_poses: FloatArray,
        shape_sizes: FloatArray,
        pairs: IntArray,
        scene_shapes: IntArray,
    ) -> None:
        """Build a robot; fixed joints must already be folded into its transforms.

        Args:
            origins: (n, 4, 4) fixed transforms, previous moving frame (or base) to joint i's frame.
            axes: (n, 3) unit axes in the joints' frames.
            prismatic: (n,) whether a joint slides along its axis rather than turning about it.
            tool: (4, 4) last moving frame to the tool frame.
            lower: (n,) lower planning limits, rad (m for prismatic joints).
            upper: (n,) upper planning limits.
            shape_kinds: (m,) 0 sphere, 1 capsule, 2 cylinder, 3 box.
            shape_frames: (m,) 0 the base, i + 1 the frame that moves with joint i.
            shape_poses: (m, 4, 4) poses in those frames; capsules and cylinders lie along z.
            shape_sizes: (m, 3), m: sphere (r, 0, 0); capsule and cylinder (r, half length, 0), a capsule's without
                its caps; box half extents.
            pairs: (p, 2) indices of shapes checked against each other.
            scene_shapes: (k,) indices of shapes checked against the scene.
        """

    @property
    def dof(self) -> int:
        """Number of joints."""

class Scene:
    """Obstacles in the robot's base frame."""

    def __init__(
        self,
        *,
        shape_kinds: IntArray,
        shape_poses: FloatArray,
        shape_sizes: FloatArray,
        ground: float | None,
        margin: float,
    ) -> None:
        """Build a scene from shapes described as a robot's are.

        Args:
            shape_kinds: (m,) 0 sphere, 1 capsule, 2 cylinder, 3 box.
            shape_poses: (m, 4, 4) poses in the base frame.
            shape_sizes: (m, 3), m.
            ground: height of a floor plane, m; None for no floor.
            margin: a state is free when every checked distance is provably larger, m.
        """

def fk(robot: Robot, q: FloatArray) -> FloatArray:
    """Return the tool poses (b, 4, 4), m, of joint positions q (b, n)."""

def joint_frames(robot: Robot, q: FloatArray) -> FloatArray:
    """Return the frames (b, n, 4, 4) that move with each joint, after its motion."""

def is_free(robot: Robot, scene: Scene, q: FloatArray) -> BoolArray:
    """Return which states q (b, n) are provably free of collision (b,). Joint limits are not looked at."""

def edge_is_free(robot: Robot, scene: Scene, q0: FloatArray, q1: FloatArray, resolution: float) -> BoolArray:
    """Return which straight edges from q0 to q1 (b, n) are free (b,).

    Looks at (1 - t) q0 + t q1 for t = i / k, i = 0..k, with k = ceil(max |q1 - q0| / resolution); resolution in rad.
    """

def clearance(robot: Robot, scene: Scene, q: FloatArray) -> FloatArray:
    """Return a certified lower bound (b,) of the smallest checked distance, m.

    Not positive where shapes touch, and then no measure of how deep; infinite where nothing is checked.
    """
