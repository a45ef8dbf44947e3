"""Enclose a link's triangles in a few primitives: split where that saves most room, as often as it pays.

The solid inside the triangles is enclosed as well: a plane splits it in two, and a half lies in the convex hull of the
surface on its side with the surface's points on the plane.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from plancurate.robots.adding.clipping import clip, side_points
from plancurate.robots.adding.enclosing import directions, enclose, hull_points
from plancurate.robots.adding.surroundings import Surroundings
from plancurate.robots.shapes import BoolArray, FloatArray, Shape

SHARES = (0.2, 0.35, 0.5, 0.65, 0.8)  # where splits are tried, of the extent along a direction
PRICE = 0.03  # share of the first shape's excess that one more shape must save


@dataclass(frozen=True, eq=False)
class Cluster:
    """Triangles (t,3,3), the primitive that holds them, and which points of the surroundings (p,) that reaches."""

    triangles: FloatArray
    shape: Shape
    reached: BoolArray


def fit(triangles: FloatArray, most: int, room: Surroundings) -> tuple[Cluster, ...]:
    """Return one to `most` clusters: their primitives hold the triangles (t,3,3) and what they enclose."""
    stages = [[_cluster(triangles, room)]]
    splits: dict[int, list[Cluster]] = {0: best_split(stages[0][0], [], room)}
    while len(stages[-1]) < most and any(splits.values()):
        clusters = stages[-1]
        index = min(
            (key for key, halves in splits.items() if halves),
            key=lambda key: _excess([*_without(clusters, key), *splits[key]], room),
        )
        halves = splits[index]
        clusters = [*clusters[:index], halves[0], *clusters[index + 1 :], halves[1]]
        for place in (index, len(clusters) - 1):
            splits[place] = best_split(clusters[place], _without(clusters, place), room)
        stages.append(clusters)
    price = PRICE * _excess(stages[0], room)
    best = min(stages, key=lambda stage: _excess(stage, room) + price * len(stage))
    return tuple(_cluster(cluster.triangles, room, refine=True) for cluster in best)


def _cluster(triangles: FloatArray, room: Surroundings, refine: bool = False) -> Cluster:
    shape = enclose(triangles.reshape(-1, 3), room, refine)
    return Cluster(triangles, shape, room.reached(shape))


def _without(clusters: Sequence[Cluster], index: int) -> list[Cluster]:
    return [cluster for place, cluster in enumerate(clusters) if place != index]


def _excess(clusters: Sequence[Cluster], room: Surroundings) -> float:
    return room.excess(np.any([cluster.reached for cluster in clusters], axis=0))


def best_split(cluster: Cluster, others: Sequence[Cluster], room: Surroundings) -> list[Cluster]:
    """The two parts of a cluster, cut by a plane, that stick out least beside the others; [] where no plane cuts it."""
    taken = (
        np.any([other.reached for other in others], axis=0)
        if others
        else np.zeros(len(room.points), dtype=bool)
    )
    best: tuple[float, Cut | None] = (np.inf, None)
    for cut in cuts(cluster.triangles, directions(hull_points(cluster.triangles.reshape(-1, 3))), SHARES):
        reached = np.any([taken, *(room.reached(enclose(side, room)) for side in cut.sides)], axis=0)
        best = min(best, (room.excess(reached), cut), key=lambda split: split[0])
    return [_cluster(part, room) for part in best[1].parts(cluster.triangles)] if best[1] else []


@dataclass(frozen=True, eq=False)
class Cut:
    """A plane through triangles, and the points (n,3) that hold what is on either side of it."""

    normal: FloatArray
    offset: float
    sides: tuple[FloatArray, FloatArray]

    def parts(self, triangles: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The triangles (t,3,3) on either side."""
        return clip(triangles, self.normal, self.offset), clip(triangles, -self.normal, -self.offset)


def cuts(triangles: FloatArray, normals: FloatArray, shares: Sequence[float]) -> Iterator[Cut]:
    """Planes across the normals (k,3), at `shares` of the extent of the triangles (t,3,3) along each."""
    for normal in normals:
        along = triangles.reshape(-1, 3) @ normal
        for offset in along.min() + np.array(shares) * np.ptp(along):
            sides = side_points(triangles, normal, offset), side_points(triangles, -normal, -offset)
            if min(len(side) for side in sides) > 3:
                yield Cut(normal, float(offset), sides)
