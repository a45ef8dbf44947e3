"""Which of a robot's collision shapes are checked against which."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, product
from pathlib import Path

import numpy as np

from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.robots.chain import Chain
from plancurate.robots.robot_file import RobotFile
from plancurate.robots.shapes import IntArray, Shape
from plancurate.robots.urdf import Urdf


@dataclass(frozen=True, eq=False)
class LinkShape:
    """A collision shape of `link`, posed in moving frame `frame`: 0 is the base, i + 1 moves with joint i."""

    link: str
    frame: int
    shape: Shape


def link_shapes(urdf: Urdf, chain: Chain) -> tuple[LinkShape, ...]:
    """All collision shapes in their moving frames; raise PlancurateError where there is none."""
    shapes = tuple(
        LinkShape(name, placement.frame, Shape(shape.kind, shape.size, placement.pose @ shape.pose))
        for name, placement in chain.placements.items()
        for shape in urdf.links[name].shapes
    )
    if not shapes:
        raise PlancurateError(
            f"{urdf.file}: no link has a <collision> shape; without one nothing can be checked"
        )
    return shapes


def allowed_pairs(file: Path, content: RobotFile, chain: Chain) -> frozenset[frozenset[str]]:
    """Link pairs never checked: listed in `robot.yaml`, rigid to each other, or joined by a moving joint."""
    allowed = {_allowed_pair(file, pair, chain) for pair in content.allowed_contacts}
    for frame in range(len(chain.joints) + 1):
        links, next_links = chain.links_in(frame), chain.links_in(frame + 1)
        allowed |= {frozenset(pair) for pair in combinations(links, 2)}
        allowed |= {frozenset(pair) for pair in product(links, next_links)}
    return frozenset(allowed)


def _allowed_pair(file: Path, pair: tuple[str, str], chain: Chain) -> frozenset[str]:
    for link in pair:
        if link not in chain.placements:
            raise PlancurateError(
                f"{file}: allowed_contacts: {UnknownNameError('link', link, chain.placements)}"
            )
    if pair[0] == pair[1]:
        raise PlancurateError(
            f"{file}: allowed_contacts: ['{pair[0]}', '{pair[1]}'] must name two different links"
        )
    return frozenset(pair)


def checked_pairs(shapes: tuple[LinkShape, ...], allowed: frozenset[frozenset[str]]) -> IntArray:
    """Index pairs (p,2) of the shapes that are checked against each other."""
    pairs = [
        (first, second)
        for first, second in combinations(range(len(shapes)), 2)
        if shapes[first].link != shapes[second].link
        and frozenset((shapes[first].link, shapes[second].link)) not in allowed
    ]
    return np.array(pairs, dtype=np.int32).reshape(-1, 2)


def scene_shapes(shapes: tuple[LinkShape, ...], unchecked: frozenset[str]) -> IntArray:
    """Indices (k,) of the shapes that are checked against the scene."""
    return np.array(
        [index for index, shape in enumerate(shapes) if shape.link not in unchecked], dtype=np.int32
    )
