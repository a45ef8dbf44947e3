"""Split primitives where that takes most false touches away, as the kernel counts them in drawn states.

A fit looks at how far primitives stick out of a link; this looks at what that costs: states of the arm that its
surfaces allow and its primitives refuse.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from plancurate import native
from plancurate.robots.adding.enclosing import directions, enclose, hull_points
from plancurate.robots.adding.fitting import Cluster, cuts
from plancurate.robots.adding.model import Model
from plancurate.robots.adding.surroundings import Surroundings
from plancurate.robots.scene import empty_scene
from plancurate.robots.shapes import BoolArray, FloatArray, Shape

LOST = 0.04  # share of the states that primitives may refuse before any is split
MOST_SPLITS = 16  # of a robot: each makes every check slower
SHARES = (0.05, 0.12, 0.2, 0.35, 0.5, 0.65, 0.8, 0.88, 0.95)  # where splits are tried; near the ends too
LOOKED_AT = 3  # of the planes that seem best: there the kernel chooses the primitives of the halves
REFUSED_ANYWAY = 0.25  # what a touch counts for in a state in which others touch as well

Clusters = Mapping[str, Sequence[Cluster]]


@dataclass(frozen=True, eq=False)
class Apart:
    """States (b,n) in which the surfaces of no two links in `pairs` touch: if their primitives do, that is false."""

    model: Model
    states: FloatArray
    pairs: Sequence[tuple[str, str]]

    def touched(self, link: str, shapes: Sequence[Shape], clusters: Clusters) -> BoolArray:
        """In which states (b,) shapes of a link touch the primitives of others."""
        others = [(set(pair) - {link}).pop() for pair in self.pairs if link in pair]
        posed = self.model.with_shapes(
            shapes_of({other: clusters[other] for other in others}) | {link: shapes}
        )
        return self._refused(posed, [(link, other) for other in others])

    def refused(self, clusters: Clusters) -> BoolArray:
        """In which states (b,) some primitives touch."""
        return self._refused(self.model.with_shapes(shapes_of(clusters)), self.pairs)

    def _refused(self, posed: Model, pairs: Sequence[tuple[str, str]]) -> BoolArray:
        rows = [row for a, b in pairs for row in product(posed.indices(a), posed.indices(b))]
        return np.asarray(~native.is_free(posed.of_shapes(rows), empty_scene().native, self.states))


@dataclass(frozen=True, eq=False)
class Split:
    """The halves that a cluster may be replaced by, and how many states fewer are then refused."""

    cluster: Cluster
    gain: float = 0.0
    halves: tuple[Cluster, ...] = ()


def shapes_of(clusters: Clusters) -> dict[str, tuple[Shape, ...]]:
    """The primitives of each link's clusters."""
    return {link: tuple(cluster.shape for cluster in found) for link, found in clusters.items()}


def split_where_it_pays(fitted: Clusters, rooms: Mapping[str, Surroundings], apart: Apart) -> Clusters:
    """Split one cluster after another, until few enough states are lost or no split wins any back."""
    clusters = dict(fitted)
    bounds: dict[tuple[str, Cluster], float] = {}  # what a split may gain: what it gained when last looked at
    for _ in range(MOST_SPLITS):
        if apart.refused(clusters).sum() <= LOST * len(apart.states):
            break
        link, split = _best_split(clusters, rooms, apart, bounds)
        if split.gain <= 0:
            break
        kept = [cluster for cluster in clusters[link] if cluster is not split.cluster]
        clusters[link] = (*kept, *split.halves)
    return clusters


def _best_split(
    clusters: Clusters,
    rooms: Mapping[str, Surroundings],
    apart: Apart,
    bounds: dict[tuple[str, Cluster], float],
) -> tuple[str, Split]:
    """The link and the split that gain most; a cluster is looked at only while its split may gain more than others'."""
    choices = [(link, cluster) for link, found in clusters.items() for cluster in found]
    for link, cluster in choices:
        if (link, cluster) not in bounds:
            touched = apart.touched(link, [cluster.shape], clusters).sum()
            bounds[link, cluster] = (1 + REFUSED_ANYWAY) * float(touched)
    tried: dict[tuple[str, Cluster], Split] = {}
    while (best := max(choices, key=lambda choice: bounds[choice])) not in tried:
        link, cluster = best
        tried[best] = _split(cluster, rooms[link], _cost(cluster, link, clusters, apart))
        bounds[best] = tried[best].gain
    return best[0], tried[best]


def _cost(
    cluster: Cluster, link: str, clusters: Clusters, apart: Apart
) -> Callable[[Sequence[Shape]], float]:
    """How many states shapes would have refused in place of a cluster; states that are refused anyway count less."""
    others = [other for other in clusters[link] if other is not cluster]
    anyway = apart.refused({**clusters, link: others})

    def cost(shapes: Sequence[Shape]) -> float:
        touched = apart.touched(link, shapes, clusters)
        return float((touched & ~anyway).sum() + REFUSED_ANYWAY * touched.sum())

    return cost


def _split(cluster: Cluster, room: Surroundings, cost: Callable[[Sequence[Shape]], float]) -> Split:
    """The split of a cluster that gains most."""
    before, best = cost([cluster.shape]), Split(cluster)
    corners = hull_points(cluster.triangles.reshape(-1, 3))
    normals = np.concatenate([directions(corners), cluster.shape.pose[:3, :3].T])
    found = []
    for cut in cuts(cluster.triangles, normals, SHARES):
        shapes = [enclose(side, room) for side in cut.sides]
        found.append((cost(shapes), room.union(shapes), cut))
    for _, _, cut in sorted(found, key=lambda entry: entry[:2])[:LOOKED_AT]:
        shapes = [enclose(side, room, refine=True, touches=lambda shape: cost([shape])) for side in cut.sides]
        if (gain := before - cost(shapes)) > best.gain:
            halves = zip(cut.parts(cluster.triangles), shapes, strict=True)
            best = Split(
                cluster, gain, tuple(Cluster(part, shape, room.reached(shape)) for part, shape in halves)
            )
    return best
