"""Candidates and selections of a study, to be looked at."""

from __future__ import annotations

import numpy as np

from plancurate.errors import PlancurateError
from plancurate.tasks.curation.pool import load_waypoints
from plancurate.tasks.pictures.lake_shots import selection_rows, selection_shot
from plancurate.tasks.pictures.shot import BAD, GOOD, Run, Shot
from plancurate.tasks.study.context import PoolContext, StudyContext
from plancurate.tasks.study.references import ranked_candidates, rows_of
from plancurate.tasks.study.rows import Cell
from plancurate.tasks.study.selections import study_pool, wanted_selections


def extreme_shots(study: StudyContext, pool: PoolContext) -> list[Shot]:
    """The best and the worst candidate of a pool, by composite score, to the target where they differ most."""
    loaded = study_pool(study, pool)
    ranked = ranked_candidates(study, pool, loaded)
    targets, scores = (ranked[name].to_numpy() for name in ("target_id", "score"))
    known, first = np.unique(targets, return_index=True)
    last = len(targets) - 1 - np.unique(targets[::-1], return_index=True)[1]
    widest = int((scores[last] - scores[first]).argmax())
    places = [int(first[widest]), int(last[widest])]
    ids = ranked["trajectory_id"].take(places).to_pylist()
    rows = rows_of(loaded, ids).to_pylist()
    paths = load_waypoints(study.lake, pool.partition, ids)
    runs = [
        Run(
            np.arange(len(path), dtype=np.float64) * row["dt"],
            path,
            colour,
            f"tool path {row['path_length']:.2f} m, joints {row['joint_movement']:.2f} rad, {row['duration']:.1f} s",
            np.array([row["target_x"], row["target_y"], row["target_z"]]),
        )
        for row, path, colour in zip(rows, paths, (GOOD, BAD), strict=True)
    ]
    words = [f"{which} score to target {known[widest]}" for which in ("best", "worst")]
    (scene,) = pool.scenes_of_targets([int(known[widest])])
    return [Shot(pool.robot, scene, (run,), title=title) for run, title in zip(runs, words, strict=True)]


def kept_shot(study: StudyContext, pool: PoolContext, cell: Cell) -> Shot:
    """The tool paths that a selection of a pool keeps, of several draws the first; PlancurateError for another."""
    for wanted in wanted_selections(study, pool, study_pool(study, pool)):
        if (wanted.choice.label, wanted.budget) == (cell.selector, cell.budget):
            return selection_shot(selection_rows(study.lake, wanted.selection_id), pool.robot, pool.scene)
    raise PlancurateError(f"study {study.study}: no selection {cell.selector} in {pool.title}")
