"""Are like or unlike paths better to learn from? Selections of one size from one pool, on development targets alone.

    python experiments/alike.py [--home data/development] [--json rates.json]

Keeps k paths of each target: any, those nearest to what neighbouring targets keep, or those farthest from it and from
each other. Scores play no part, but a path that is unlike others may be a longer one; so all three are measured again
among the better half of each target's scores. Pools (those of development.yaml), networks and tests are as in
parameters.py.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Literal

import numpy as np
from parameters import Groups, compare
from pydantic import Field
from scipy.spatial.distance import cdist

from plancurate.errors import PlancurateError
from plancurate.tasks.candidates.path_classes import POINTS, resampled
from plancurate.tasks.curation.pool import FloatArray
from plancurate.tasks.curation.selectors.base import IntArray, Kept, Problem, selector
from plancurate.tasks.curation.selectors.mode_consistent import neighbours
from plancurate.tasks.curation.selectors.ranking import ScoreSettings, composite_scores
from plancurate.tasks.curation.selectors.transitions import target_rows

NEIGHBOURS = 8
SWEEPS = 10
"""Times that each target chooses anew, given what its neighbours keep."""
GROUPS: Groups = {
    f"the better {share:.0%}": [
        {"name": "Paths", "prefer": prefer, "best_share": share} for prefer in ("any", "alike", "unlike")
    ]
    for share in (1.0, 0.5)
}


class PathsSettings(ScoreSettings):
    """Which paths are preferred, and among how many of each target's."""

    prefer: Literal["any", "alike", "unlike"] = "any"
    best_share: float = Field(1.0, gt=0, le=1, description="share of a target's paths, the best scores")


@selector("Paths", PathsSettings)
def paths(problem: Problem, settings: PathsSettings) -> Kept:
    """Keep k paths of each target: any, those like its neighbours', or those unlike them and each other."""
    with problem.stage("prepare"):
        apart = path_distances(problem.waypoints(problem.pool.candidates["trajectory_id"].to_pylist()))
        target = target_rows(problem)
    score = composite_scores(problem, settings)
    with problem.stage("select"):
        rng, present = np.random.default_rng(problem.seed), np.unique(target)
        allowed = [best(np.flatnonzero(target == row), score, settings.best_share) for row in present]
        kept = [rng.permutation(rows)[: problem.budget] for rows in allowed]
        if settings.prefer != "any":
            choose = nearest if settings.prefer == "alike" else farthest
            near = neighbours(problem.pool.target_positions()[present], NEIGHBOURS)
            for place in [place for _ in range(SWEEPS) for place in rng.permutation(len(present))]:
                others = np.concatenate([kept[other] for other in near[place]])
                kept[place] = choose(apart, allowed[place], others, problem.budget)
    return Kept(np.concatenate(kept))


def path_distances(waypoints: Sequence[FloatArray]) -> FloatArray:
    """Distance (paths, paths), rad: root mean square over equally spaced points of the Euclidean joint distance."""
    points = np.array([resampled(path).ravel() for path in waypoints])
    return np.asarray(cdist(points, points) / np.sqrt(POINTS))


def best(rows: IntArray, score: FloatArray, share: float) -> IntArray:
    """The share of the rows with the lowest scores."""
    return rows[np.argsort(score[rows], kind="stable")[: int(np.ceil(share * len(rows)))]]


def nearest(apart: FloatArray, rows: IntArray, others: IntArray, count: int) -> IntArray:
    """So many of the rows: those that are nearest to the others, on average."""
    return rows[np.argsort(apart[np.ix_(rows, others)].mean(axis=1), kind="stable")[:count]]


def farthest(apart: FloatArray, rows: IntArray, others: IntArray, count: int) -> IntArray:
    """So many of the rows: one after another that which is farthest from the others and from those taken."""
    taken: list[int] = []
    away = apart[np.ix_(rows, others)].min(axis=1)
    for _ in range(min(count, len(rows))):
        taken.append(int(rows[away.argmax()]))
        away = np.minimum(away, apart[rows, taken[-1]])
    return np.array(taken)


if __name__ == "__main__":
    try:
        compare(__doc__ or "", GROUPS, seeds=2)
    except PlancurateError as error:
        sys.exit(f"{error}")
