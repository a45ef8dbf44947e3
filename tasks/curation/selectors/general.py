"""No selection at all."""

from __future__ import annotations

import numpy as np

from plancurate.tasks.curation.selectors.base import Kept, Problem, Settings, selector


@selector("General", budgeted=False, seeded=False)
def general(problem: Problem, settings: Settings) -> Kept:
    """Keep the whole pool."""
    return Kept(np.arange(problem.pool.candidates.num_rows))
