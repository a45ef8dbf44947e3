"""Primitives for all links: coarse at first, then split where they touch in states in which the links do not."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.spatial import cKDTree

from plancurate import native
from plancurate.robots.adding.fitting import Cluster, best_split, fit, tightened
from plancurate.robots.adding.model import Model
from plancurate.robots.adding.quality import sample_surface
from plancurate.robots.adding.solids import Solid
from plancurate.robots.scene import empty_scene
from plancurate.robots.shapes import FloatArray, Shape

COARSE = 4  # most primitives of a link before it is known where they are too large
DRAWS, LOOKED_AT = 4000, 40  # states drawn, and of those in which a pair touches, looked at
APART = 0.02  # of a link's size that two surfaces are apart at least where a touch of their primitives is false
EXCESS = 0.002  # share of states that a pair may touch falsely
ROUNDS = 80
POINTS = 3000  # of a link's surface


@dataclass(frozen=True)
class FalseTouch:
    """Two links: the share of states that they touch in falsely, and some of those states (k,n)."""

    links: tuple[str, str]
    share: float
    states: FloatArray


class Surfaces:
    """Points of the links' surfaces, to tell how far two links are apart."""

    def __init__(self, model: Model, solids: Mapping[str, Solid]) -> None:
        rng = np.random.default_rng(0)
        self.model = model
        self.places = model.chain.placements
        self.points = {
            link: sample_surface(solid.triangles, POINTS, rng)
            for link, solid in solids.items()
            if len(solid.triangles)
        }
        self.trees = {link: cKDTree(points) for link, points in self.points.items()}
        self.robot = model.of_shapes([])

    def apart(self, first: str, second: str, states: FloatArray) -> FloatArray:
        """Distance (b,), m, of two links' points in states (b,n)."""
        frames = native.joint_frames(self.robot, states)
        return np.array([self._distance(first, second, moved) for moved in frames])

    def _distance(self, first: str, second: str, moved: FloatArray) -> float:
        pose = np.linalg.inv(self._pose(second, moved)) @ self._pose(first, moved)
        points = self.points[first] @ pose[:3, :3].T + pose[:3, 3]
        return float(self.trees[second].query(points)[0].min())

    def _pose(self, link: str, moved: FloatArray) -> FloatArray:
        place = self.places[link]
        return np.asarray(place.pose if place.frame == 0 else moved[place.frame - 1] @ place.pose)

    def gap(self, link: str) -> float:
        """Distance, m, between surfaces that counts as apart."""
        return APART * float(np.linalg.norm(np.ptp(self.points[link], axis=0)))


def refined(model: Model, solids: Mapping[str, Solid], most: int) -> dict[str, tuple[Shape, ...]]:
    """Return at most `most` primitives for each link's triangles, beside its own primitives."""
    clusters = {link: fit(solid.triangles, min(COARSE, most)) for link, solid in solids.items()}
    surfaces, states = Surfaces(model, solids), model.draw(DRAWS, seed=2)
    stuck: set[tuple[str, str]] = set()
    touches: dict[tuple[str, str], FalseTouch] = {}
    changed = set(clusters)
    for _ in range(ROUNDS):
        posed = model.with_shapes({link: [c.shape for c in parts] for link, parts in clusters.items()})
        for pair in posed.unrelated_pairs():
            if changed & set(pair):
                touches[pair] = false_touch(posed, surfaces, pair, states)
        worst = max((t for t in touches.values() if t.links not in stuck), key=lambda t: t.share, default=None)
        if worst is None or worst.share < EXCESS:
            break
        link = _split_worst(posed, clusters, worst, most)
        changed = {link} if link else set()
        if link is None:
            stuck.add(worst.links)
    return {
        link: (*solid.shapes, *(tightened(cluster) for cluster in clusters[link])) for link, solid in solids.items()
    }


def false_touch(model: Model, surfaces: Surfaces, pair: tuple[str, str], states: FloatArray) -> FalseTouch:
    """In how many states a pair's primitives touch while their surfaces are apart."""
    touching = ~native.is_free(model.of_links(*pair), empty_scene().native, states)
    some = states[touching][:LOOKED_AT]
    if not len(some):
        return FalseTouch(pair, 0.0, some)
    false = surfaces.apart(*pair, some) > min(surfaces.gap(link) for link in pair)
    return FalseTouch(pair, float(touching.mean() * false.mean()), some[false])


def _split_worst(model: Model, clusters: dict[str, list[Cluster]], touch: FalseTouch, most: int) -> str | None:
    """Split, in place, the cluster that causes most of a pair's false touches; return its link, None if none can be."""
    first, second = (model.indices(link) for link in touch.links)
    votes: Counter[tuple[int, int]] = Counter()
    for row in product(first, second):
        hits = ~native.is_free(model.of_shapes([row]), empty_scene().native, touch.states)
        votes[row] = int(hits.sum())
    choices = [
        (link, index - own[0])
        for row, _ in votes.most_common(1)
        for link, own, index in zip(touch.links, (first, second), row, strict=True)
        if len(own) < most
    ]
    for link, place in sorted(choices, key=lambda choice: -clusters[choice[0]][choice[1]].slack):
        if halves := best_split(clusters[link][place]):
            clusters[link][place : place + 1] = halves
            return link
    return None
