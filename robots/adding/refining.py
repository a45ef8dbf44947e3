"""Primitives for all links: fitted to each alone, then again where they touch in states in which the links do not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from plancurate import native
from plancurate.robots.adding.fitting import Cluster, fit
from plancurate.robots.adding.model import Model
from plancurate.robots.adding.quality import boundary, depth, sample_surface
from plancurate.robots.adding.solids import Solid
from plancurate.robots.adding.splitting import Apart, Clusters, shapes_of, split_where_it_pays
from plancurate.robots.adding.surroundings import Surroundings, surroundings
from plancurate.robots.scene import empty_scene
from plancurate.robots.shapes import BoolArray, FloatArray, Shape

DRAWS, LOOKED_AT = 4000, 40  # states drawn, and of those in which a pair touches, looked at
JUDGED = 2000  # of the states drawn, those that splits are judged by
APART = (
    0.01  # of a link's size that two surfaces are apart at least where a touch of their primitives is false
)
EXCESS = 0.003  # share of states that a pair may touch falsely
ROUNDS, MORE_SHAPES = 2, 2  # times that links are fitted again, with so many more primitives each time
WEIGHT = (
    10.0  # of where other links come to, as a multiple of all else that a link's primitives stick out into
)
POINTS, BOUNDARY = 3000, 400  # of a link's surface and of a primitive's

Shapes = dict[str, tuple[Shape, ...]]


@dataclass(frozen=True, eq=False)
class FalseTouch:
    """Two links: the share of states with a false touch; in some, the second's poses (k,4,4) seen from the first."""

    links: tuple[str, str]
    share: float
    poses: FloatArray


class Surfaces:
    """Points of the links' surfaces, to tell how far two links are apart."""

    def __init__(self, model: Model, solids: Mapping[str, Solid]) -> None:
        rng = np.random.default_rng(0)
        self.model, self.robot = model, model.of_shapes([])
        self.points = {
            link: sample_surface(solid.triangles, POINTS, rng)
            for link, solid in solids.items()
            if len(solid.triangles)
        }
        self.trees = {link: cKDTree(points) for link, points in self.points.items()}

    def relative(self, first: str, second: str, states: FloatArray) -> FloatArray:
        """Poses (b,4,4) of the second link seen from the first in states (b,n)."""
        frames = native.joint_frames(self.robot, states)
        return np.asarray(np.linalg.inv(self._poses(first, frames)) @ self._poses(second, frames))

    def _poses(self, link: str, frames: FloatArray) -> FloatArray:
        place = self.model.chain.placements[link]
        moved = np.eye(4)[None] if place.frame == 0 else frames[:, place.frame - 1]
        return np.asarray(moved @ place.pose)

    def apart(self, first: str, second: str, poses: FloatArray) -> BoolArray:
        """Whether two links' points are apart at each of the poses (b,4,4) of the second seen from the first."""
        sizes = [float(np.linalg.norm(np.ptp(self.points[link], axis=0))) for link in (first, second)]
        near = [
            self.trees[first].query(
                moved(self.points[second], pose), distance_upper_bound=APART * min(sizes)
            )[0]
            for pose in poses
        ]
        return np.array([np.isinf(distances).all() for distances in near], dtype=bool)


def refined(model: Model, solids: Mapping[str, Solid], most: int) -> Shapes:
    """Return primitives for each link's triangles, at most `most` before those that false touches ask for."""
    meshed = {link: solid.triangles for link, solid in solids.items() if len(solid.triangles)}
    rooms, clusters = fitted_alone(meshed, most)
    surfaces, states = Surfaces(model, solids), model.draw(DRAWS, seed=2)
    touches = false_touches(model, clusters, surfaces, states)
    for number in range(1, ROUNDS + 1):
        asked = _narrowed(rooms, clusters, touches)
        if not asked:
            break
        again = {link: fit(meshed[link], most + number * MORE_SHAPES, room) for link, room in asked.items()}
        tried = clusters | again
        found = false_touches(model, tried, surfaces, states)
        if sum(touch.share for touch in found) < sum(touch.share for touch in touches):
            clusters, touches = tried, found
        rooms |= asked
    apart = states_apart(model.with_shapes(shapes_of(clusters)), surfaces, states[:JUDGED])
    fitted = shapes_of(split_where_it_pays(clusters, rooms, apart))
    return {link: (*solid.shapes, *fitted.get(link, ())) for link, solid in solids.items()}


def fitted_alone(
    meshed: Mapping[str, FloatArray], most: int
) -> tuple[dict[str, Surroundings], dict[str, tuple[Cluster, ...]]]:
    """Surroundings and clusters of each link; links with the same mesh, as fingers have, are fitted once."""
    once: dict[bytes, tuple[Surroundings, tuple[Cluster, ...]]] = {}
    for triangles in meshed.values():
        if (mesh := triangles.tobytes()) not in once:
            room = surroundings(triangles)
            once[mesh] = room, fit(triangles, most, room)
    found = {link: once[triangles.tobytes()] for link, triangles in meshed.items()}
    rooms = {link: room for link, (room, _) in found.items()}
    return rooms, {link: clusters for link, (_, clusters) in found.items()}


def states_apart(model: Model, surfaces: Surfaces, states: FloatArray) -> Apart:
    """Those of the states (b,n) in which no surfaces touch; pairs that touch in all of them are left out."""
    touched, pairs = np.zeros(len(states), dtype=bool), []
    for pair in model.unrelated_pairs():
        rows = np.flatnonzero(~native.is_free(model.of_links(*pair), empty_scene().native, states))
        near = rows[~surfaces.apart(*pair, surfaces.relative(*pair, states[rows]))]
        if len(near) < len(states):
            pairs.append(pair)
            touched[near] = True
    return Apart(model, states[~touched], pairs)


def false_touches(
    model: Model, clusters: Clusters, surfaces: Surfaces, states: FloatArray
) -> list[FalseTouch]:
    """Pairs of links whose primitives touch in too many of the states (b,n) in which their surfaces are apart."""
    posed = model.with_shapes(shapes_of(clusters))
    found = [_false_touch(posed, surfaces, pair, states) for pair in posed.unrelated_pairs()]
    return [touch for touch in found if touch.share > EXCESS]


def _false_touch(model: Model, surfaces: Surfaces, pair: tuple[str, str], states: FloatArray) -> FalseTouch:
    touching = ~native.is_free(model.of_links(*pair), empty_scene().native, states)
    poses = surfaces.relative(*pair, states[touching][:LOOKED_AT])
    false = surfaces.apart(*pair, poses)
    share = touching.mean() * false.mean() if len(false) else 0.0
    return FalseTouch(pair, float(share), poses[false])


def _narrowed(
    rooms: Mapping[str, Surroundings], clusters: Clusters, touches: list[FalseTouch]
) -> dict[str, Surroundings]:
    """The surroundings of the links that touch falsely, with points of what they touch."""
    fitted = shapes_of(clusters)
    extra: dict[str, list[FloatArray]] = {}
    for touch in touches:
        first, second = touch.links
        extra.setdefault(first, []).append(_intruding(fitted[second], fitted[first], touch.poses))
        back = np.asarray(np.linalg.inv(touch.poses), dtype=np.float64)
        extra.setdefault(second, []).append(_intruding(fitted[first], fitted[second], back))
    return {
        link: rooms[link].with_points(np.concatenate(points), WEIGHT * rooms[link].union(fitted[link]))
        for link, points in extra.items()
        if sum(len(found) for found in points)
    }


def _intruding(others: tuple[Shape, ...], own: tuple[Shape, ...], poses: FloatArray) -> FloatArray:
    """Points (p,3) of the boundaries of primitives, at the poses (k,4,4), that lie in some of one's own."""
    rng = np.random.default_rng(0)
    points = np.concatenate([boundary(shape, rng, BOUNDARY) for shape in others])
    seen = np.concatenate([np.empty((0, 3)), *(moved(points, pose) for pose in poses)])
    inside = np.any([depth(shape, seen) > 0 for shape in own], axis=0)
    return np.asarray(seen[inside])


def moved(points: FloatArray, pose: FloatArray) -> FloatArray:
    """Points (n,3) brought to a pose (4,4)."""
    return np.asarray(points @ pose[:3, :3].T + pose[:3, 3])
