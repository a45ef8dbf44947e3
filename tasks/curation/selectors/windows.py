"""From kept steps of the pool to where training windows begin.

Only beginnings are filtered: what a window holds is read from the whole trajectory, for steps glued together
would teach a robot to jump.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from plancurate.tasks.curation.selectors.base import IntArray
from plancurate.tasks.curation.selectors.transitions import Transitions
from plancurate.tasks.learning.demonstrations import HOLD_STEPS

Mask = npt.NDArray[np.bool_]


def kept_waypoints(transitions: Transitions, kept: Mask) -> list[IntArray]:
    """Kept waypoints of each candidate, counted from its first one; `kept` is (steps,)."""
    return [np.flatnonzero(mask) for mask in np.split(kept, transitions.starts[1:])]


def window_counts(transitions: Transitions, kept: Mask) -> IntArray:
    """Training windows (candidates,) that begin at kept steps (steps,); a kept last one is held for a while."""
    last = transitions.starts + transitions.lengths - 1
    counts = np.add.reduceat(kept.astype(np.int64), transitions.starts)
    return np.asarray(counts + HOLD_STEPS * kept[last])
