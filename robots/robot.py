"""What a robot is."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from plancurate import native
from plancurate.robots.chain import Chain
from plancurate.robots.contacts import LinkShape
from plancurate.robots.shapes import FloatArray, IntArray, shape_arrays


@dataclass(frozen=True, eq=False)
class Robot:
    """A serial arm of n joints; limits, `effort` and `home` are (n,) in rad (m), s and N m (N)."""

    name: str
    urdf: Path
    joint_names: tuple[str, ...]
    lower: FloatArray
    upper: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
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
