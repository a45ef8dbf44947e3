"""What a robot is."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from plancurate import native
from plancurate.robots.chain import Chain
from plancurate.robots.contacts import LinkShape, scene_shapes
from plancurate.robots.shapes import FloatArray, IntArray, shape_arrays

REACH_DRAWS = 100_000
NativeRobot = native.Robot  # inside the class `native` is its attribute


@dataclass(frozen=True, eq=False)
class Robot:
    """A serial arm of n joints; limits, `effort` and `home` are (n,) in rad (m), s and N m (N).

    `jerk` is infinite for a joint that has no such limit.
    """

    name: str
    urdf: Path
    joint_names: tuple[str, ...]
    lower: FloatArray
    upper: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    effort: FloatArray
    home: FloatArray
    tool_link: str
    native: native.Robot
    digest: str  # of the contents of robot.yaml and the URDF
    allowed_contacts: frozenset[frozenset[str]]  # pairs of links never checked, adjacent ones included
    scene_unchecked_links: frozenset[str]
    chain: Chain
    shapes: tuple[LinkShape, ...]

    @property
    def dof(self) -> int:
        """Number of moving joints."""
        return len(self.joint_names)

    @cached_property
    def shoulder(self) -> FloatArray:
        """Origin (3,) of the scenes that are sized by the reach, m: on the base's axis, as high as joint 2."""
        frames = native.joint_frames(self.native, self.home[None])[0]
        return np.array([0.0, 0.0, round(float(frames[min(1, self.dof - 1), 2, 3]), 2)])

    @cached_property
    def reach(self) -> float:
        """Greatest distance of the tool from the shoulder, m, to the centimetre, over drawn configurations."""
        q = np.random.default_rng(0).uniform(self.lower, self.upper, (REACH_DRAWS, self.dof))
        tool = native.fk(self.native, q)[:, :3, 3]
        return round(float(np.linalg.norm(tool - self.shoulder, axis=1).max()), 2)

    @cached_property
    def native_without_pairs(self) -> NativeRobot:
        """The kernel's robot that is checked against the scene alone, not against itself."""
        return native_model(
            self.chain,
            self.shapes,
            tool=np.eye(4),
            lower=self.lower,
            upper=self.upper,
            pairs=np.empty((0, 2), dtype=np.int32),
            scene_shapes=scene_shapes(self.shapes, self.scene_unchecked_links),
        )


def native_model(
    chain: Chain,
    shapes: tuple[LinkShape, ...],
    *,
    tool: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    pairs: IntArray,
    scene_shapes: IntArray,
) -> native.Robot:
    """Build the kernel's robot: `tool` (4,4) is tool to last moving frame, the rest is `native.Robot`'s."""
    return native.Robot(
        origins=chain.origins,
        axes=chain.axes,
        prismatic=chain.prismatic,
        tool=tool,
        lower=lower,
        upper=upper,
        shape_frames=np.array([shape.frame for shape in shapes], dtype=np.int32),
        pairs=pairs,
        scene_shapes=scene_shapes,
        **shape_arrays([shape.shape for shape in shapes]),
    )
