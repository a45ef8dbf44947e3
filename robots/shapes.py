"""Primitive shapes and rigid transforms: what robots and scenes are made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]
BoolArray = NDArray[np.bool_]
Kind = Literal["sphere", "capsule", "cylinder", "box"]

KIND_CODES: dict[Kind, int] = {
    "sphere": 0,
    "capsule": 1,
    "cylinder": 2,
    "box": 3,
}  # plancurate.native's numbers


@dataclass(frozen=True, eq=False)
class Shape:
    """A primitive in some frame: `pose` (4,4) is shape frame to that frame, metres.

    `size` is (radius, 0, 0) for a sphere, (radius, half length along z, 0) for a cylinder or capsule (without
    its caps), and the three half extents for a box.
    """

    kind: Kind
    size: tuple[float, float, float]
    pose: FloatArray

    def grown(self, by: float) -> Shape:
        """A shape of the same kind that reaches at least `by` (m) beyond this one everywhere."""
        a, b, c = self.size
        sizes = {
            "sphere": (a + by, b, c),
            "capsule": (a + by, b, c),
            "cylinder": (a + by, b + by, c),
            "box": (a + by, b + by, c + by),
        }
        return replace(self, size=sizes[self.kind])


def transform(xyz: Sequence[float], rpy: Sequence[float]) -> FloatArray:
    """Rigid transform (4,4) of a URDF origin: metres, and roll-pitch-yaw in radians about fixed x, y, z."""
    from scipy.spatial.transform import Rotation  # 0.4 s, which the command line's help does without

    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("xyz", list(rpy)).as_matrix()
    pose[:3, 3] = xyz
    return pose


def shape_arrays(shapes: Sequence[Shape]) -> dict[str, Any]:
    """Return the native classes' keyword arguments `shape_kinds`, `shape_poses` and `shape_sizes`."""
    return {
        "shape_kinds": np.array([KIND_CODES[shape.kind] for shape in shapes], dtype=np.int32),
        "shape_poses": np.array([shape.pose for shape in shapes], dtype=np.float64).reshape(-1, 4, 4),
        "shape_sizes": np.array([shape.size for shape in shapes], dtype=np.float64).reshape(-1, 3),
    }
