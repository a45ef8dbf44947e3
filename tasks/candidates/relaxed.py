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
COMFORT_M = 0.08  # a clearance that is worth no detour any more
PRICE = 4.0  # touching costs so many times its length more
SAMPLES = 6  # of the clearance along an edge
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
    for number in range(ROUNDS):
        spread = SPREAD_RAD * NARROWING**number + LEAST_RAD
        for first in (1, 2):  # every other waypoint, so that its neighbours stay where they are
            at = np.arange(first, len(points) - 1, 2)
            if len(at):
                before, after = points[at - 1], points[at + 1]
                points[at] = _moved(robot, scene, kept, before, points[at], after, spread, resolution, rng)
    return points


def subdivided(path: FloatArray) -> FloatArray:
    """The path's waypoints (w, n) and more between them (k, n), none farther apart than SPACING_RAD, k >= 3."""
    pieces = np.ceil(np.linalg.norm(np.diff(path, axis=0), axis=1) / SPACING_RAD).astype(int)
    pieces = np.maximum(pieces, 2 if len(path) == 2 else 1)
    shares = [np.arange(count)[:, None] / count for count in pieces.tolist()]
    parts = [a + share * (b - a) for a, b, share in zip(path[:-1], path[1:], shares, strict=True)]
    return np.concatenate([*parts, path[-1:]])


def cost(robot: Robot, scene: Scene, q0: FloatArray, q1: FloatArray) -> FloatArray:
    """What the straight edges from q0 to q1 (..., n) cost (...): their length, rad, where nothing is near."""
    share = ((np.arange(SAMPLES) + 0.5) / SAMPLES)[:, None]
    q = q0[..., None, :] + share * (q1 - q0)[..., None, :]
    flat = np.ascontiguousarray(q.reshape(-1, q.shape[-1]))
    clearance = native.clearance(robot.native_without_pairs, scene.native, flat).reshape(q.shape[:-1])
    lacking = 1 - np.clip(clearance, 0, COMFORT_M) / COMFORT_M
    return np.asarray(np.linalg.norm(q1 - q0, axis=-1) * (1 + PRICE * (lacking**2).mean(axis=-1)))


def _moved(
    robot: Robot,
    scene: Scene,
    kept: Scene,
    before: FloatArray,
    points: FloatArray,
    after: FloatArray,
    spread: float,
    resolution: float,
    rng: np.random.Generator,
) -> FloatArray:
    """Where waypoints (b, n) between those before and after go: to the cheapest place tried if the way is free."""
    b, n = points.shape
    drawn = points[:, None] + spread * rng.normal(size=(b, DRAWN, n))
    pull = rng.uniform(size=(b, PULLED, 1)) ** 2
    pulled = points[:, None] + pull * ((before + after) / 2 - points)[:, None]
    places = np.clip(np.concatenate([points[:, None], drawn, pulled], axis=1), robot.lower, robot.upper)
    ways = np.stack(
        [
            np.broadcast_to(before[:, None], places.shape),
            places,
            np.broadcast_to(after[:, None], places.shape),
        ]
    )
    best = cost(robot, scene, ways[:-1], ways[1:]).sum(axis=0).argmin(axis=1)
    chosen = places[np.arange(b), best]
    edges = np.concatenate([before, chosen]), np.concatenate([chosen, after])
    free = native.edge_is_free(robot.native, kept.native, *edges, resolution)
    return np.where((free[:b] & free[b:])[:, None], chosen, points)
