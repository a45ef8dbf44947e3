"""What relaxing does, written a second time in NumPy: an oracle for the compiled one."""

from __future__ import annotations

import numpy as np

from plancurate import native
from plancurate.robots import Robot, Scene
from plancurate.robots.shapes import FloatArray

COMFORT_M, PRICE, SAMPLES = 0.08, 4.0, 6


def cost(robot: Robot, scene: Scene, q0: FloatArray, q1: FloatArray) -> FloatArray:
    """What the straight edges from q0 to q1 (..., n) cost (...): their length, rad, where nothing is near."""
    share = ((np.arange(SAMPLES) + 0.5) / SAMPLES)[:, None]
    q = q0[..., None, :] + share * (q1 - q0)[..., None, :]
    flat = np.ascontiguousarray(q.reshape(-1, q.shape[-1]))
    clearance = native.clearance(robot.native_without_pairs, scene.native, flat).reshape(q.shape[:-1])
    lacking = 1 - np.clip(clearance, 0, COMFORT_M) / COMFORT_M
    return np.asarray(np.linalg.norm(q1 - q0, axis=-1) * (1 + PRICE * (lacking**2).mean(axis=-1)))


def relaxed_in_numpy(
    robot: Robot,
    scene: Scene,
    kept: Scene,
    path: FloatArray,
    offsets: FloatArray,
    pulls: FloatArray,
    resolution: float,
) -> FloatArray:
    """As `native.relax`."""
    points = path.copy()
    half = (len(path) - 1) // 2
    for around, toward in zip(offsets, pulls, strict=True):
        for first, part in ((1, slice(half)), (2, slice(half, None))):
            at = np.arange(first, len(points) - 1, 2)
            if len(at):
                neighbours = points[at - 1], points[at + 1]
                places = places_tried(robot, neighbours, points[at], around[part], toward[part])
                points[at] = moved(robot, scene, kept, neighbours, places, resolution)
    return points


def places_tried(
    robot: Robot,
    neighbours: tuple[FloatArray, FloatArray],
    points: FloatArray,
    around: FloatArray,
    toward: FloatArray,
) -> FloatArray:
    """Places (b, p, n) for the waypoints (b, n): where they are first."""
    middle = sum(neighbours) / 2
    drawn, pulled = points[:, None] + around, points[:, None] + toward[..., None] * (middle - points)[:, None]
    return np.clip(np.concatenate([points[:, None], drawn, pulled], axis=1), robot.lower, robot.upper)


def moved(
    robot: Robot,
    scene: Scene,
    kept: Scene,
    neighbours: tuple[FloatArray, FloatArray],
    places: FloatArray,
    resolution: float,
) -> FloatArray:
    """The cheapest of its places (b, p, n) for each waypoint whose edges there are free, else the first."""
    before, after = neighbours
    ways = cost(robot, scene, *np.broadcast_arrays(before[:, None], places))
    ways = ways + cost(robot, scene, *np.broadcast_arrays(places, after[:, None]))
    chosen = places[np.arange(len(places)), ways.argmin(axis=1)]
    edges = np.concatenate([before, chosen]), np.concatenate([chosen, after])
    free = native.edge_is_free(robot.native, kept.native, *edges, resolution)
    both = free[: len(chosen)] & free[len(chosen) :]
    return np.where(both[:, None], chosen, places[:, 0])
