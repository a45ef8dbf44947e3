"""The robot while it is added: its kinematics and shapes, before contacts and home are known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np

from plancurate import native
from plancurate.robots.chain import Chain
from plancurate.robots.contacts import LinkShape
from plancurate.robots.robot import native_model
from plancurate.robots.shapes import FloatArray, Shape


@dataclass(frozen=True, eq=False)
class Model:
    """Chain and shapes with the limits (n,) that plans keep to."""

    chain: Chain
    shapes: tuple[LinkShape, ...]
    lower: FloatArray
    upper: FloatArray

    def with_shapes(self, shapes: Mapping[str, Sequence[Shape]]) -> Model:
        """The robot with other shapes, each in its link's frame; a link that is not named has none."""
        placed = [
            LinkShape(link, place.frame, Shape(shape.kind, shape.size, place.pose @ shape.pose))
            for link, place in self.chain.placements.items()
            for shape in shapes.get(link, ())
        ]
        return replace(self, shapes=tuple(placed))

    def links(self) -> list[str]:
        """Names of the links that have shapes."""
        return list(dict.fromkeys(shape.link for shape in self.shapes))

    def unrelated_pairs(self) -> list[tuple[str, str]]:
        """Pairs of links with shapes that are neither rigid to each other nor joined by a moving joint."""
        frame = {shape.link: shape.frame for shape in self.shapes}
        return [pair for pair in combinations(self.links(), 2) if abs(frame[pair[0]] - frame[pair[1]]) > 1]

    def indices(self, link: str) -> list[int]:
        """Which of the shapes are the link's."""
        return [index for index, shape in enumerate(self.shapes) if shape.link == link]

    def of_links(self, first: str, second: str) -> native.Robot:
        """The kernel's robot with only these two links checked, against each other."""
        return self.of_shapes(list(product(self.indices(first), self.indices(second))))

    def of_shapes(self, rows: list[tuple[int, int]]) -> native.Robot:
        """The kernel's robot with only these pairs of shapes checked, by their indices."""
        return native_model(
            self.chain,
            self.shapes,
            tool=np.eye(4),
            lower=self.lower,
            upper=self.upper,
            pairs=np.array(rows, dtype=np.int32).reshape(-1, 2),
            scene_shapes=np.empty(0, dtype=np.int32),
        )

    def draw(self, count: int, seed: int) -> FloatArray:
        """States (count,n) within the limits."""
        return np.random.default_rng(seed).uniform(self.lower, self.upper, (count, len(self.lower)))
