"""Paths that are relaxed: waypoints are moved until the path is short and keeps its distance from obstacles.

A sampling planner's paths to one goal differ from run to run, even the shortest of many, so that neighbouring problems
are shown different ways. Relaxed, those that pass obstacles on the same side come to nearly the same path.
"""

from __future__ import annotations

from zlib import crc32

import numpy as np

from plancurate import native
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.robots.shapes import FloatArray

REVISION = 1  # raise when paths come out otherwise than before: ids of pools with relaxed paths hold it
SPACING_RAD = 0.7  # most between the waypoints that are moved, to begin with
ROUNDS = 60
# Places tried for a waypoint in a round: around it, and toward the middle of its neighbours.
DRAWN, PULLED = 7, 2
# Of those around it: how far the first round's lie, what share of it each next round's, and the least.
SPREAD_RAD, NARROWING, LEAST_RAD = 0.2, 0.93, 0.005


def relaxed(
    robot: Robot,
    scene: Scene,
    kept: Scene,
    path: FloatArray,
    resolution: float,
    seed: int | None = None,
) -> FloatArray:
    """A path (k, n) with the ends of `path` (w, n), w >= 2, that costs less: by its length, near obstacles by more.

    Its edges are free in `kept`, the scene grown by the clearance that must be held, if those of `path` are; they are
    checked at `resolution`, rad. Distances that cost are those from the obstacles and the floor of `scene`. The same
    arguments give the same path; without a seed the path itself seeds what is drawn, so that copies stay copies.
    """
    rng = np.random.default_rng(crc32(path.tobytes()) if seed is None else seed)
    points = subdivided(path)
    offsets, pulls = trials(len(points) - 2, robot.native.dof, rng)
    return native.relax(
        robot.native,
        robot.native_without_pairs,
        scene.native,
        kept.native,
        points,
        offsets,
        pulls,
        resolution,
    )


def subdivided(path: FloatArray) -> FloatArray:
    """The path's waypoints (w, n) and more between them (k, n), none farther apart than SPACING_RAD, k >= 3."""
    pieces = np.ceil(np.linalg.norm(np.diff(path, axis=0), axis=1) / SPACING_RAD).astype(int)
    pieces = np.maximum(pieces, 2 if len(path) == 2 else 1)
    shares = [np.arange(count)[:, None] / count for count in pieces.tolist()]
    parts = [a + share * (b - a) for a, b, share in zip(path[:-1], path[1:], shares, strict=True)]
    return np.concatenate([*parts, path[-1:]])


def trials(inner: int, n: int, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Draw where a path's `inner` waypoints of n joints are tried: `native.relax`'s offsets, rad, and pulls."""
    offsets, pulls = np.empty((ROUNDS, inner, DRAWN, n)), np.empty((ROUNDS, inner, PULLED))
    half = (inner + 1) // 2
    for number in range(ROUNDS):
        spread = SPREAD_RAD * NARROWING**number + LEAST_RAD
        for part in (slice(half), slice(half, inner)):  # every other waypoint, then those between
            offsets[number, part] = spread * rng.normal(size=offsets[number, part].shape)
            pulls[number, part] = rng.uniform(size=pulls[number, part].shape) ** 2
    return offsets, pulls
