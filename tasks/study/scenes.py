"""What lies in which scene: most of a pool's work is done a scene at a time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from plancurate.robots import Scene

IntArray = npt.NDArray[np.int64]


def rows_by_scene(scenes: Sequence[Scene]) -> Iterator[tuple[Scene, IntArray]]:
    """Give each scene of a sequence once, and the rows (k,) where it stands, both in their order."""
    rows: dict[Scene, list[int]] = {}
    for row, scene in enumerate(scenes):
        rows.setdefault(scene, []).append(row)
    for scene, own in rows.items():
        yield scene, np.array(own, dtype=np.int64)


def in_their_order(groups: Sequence[IntArray]) -> IntArray:
    """Where each row is found (rows,) among what was done group by group, one after another."""
    return np.argsort(np.concatenate(groups))
