"""What a study's networks learn from: the trajectories of a selection, and corrections."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from plancurate.tasks.curation.pool import FloatArray, load_waypoints, waypoint_arrays
from plancurate.tasks.curation.selectors.selection import Selection
from plancurate.tasks.learning.demonstrations import Demonstrations, demonstrations, limited_share
from plancurate.tasks.study.context import PoolContext, StudyContext
from plancurate.tasks.study.selections import WantedSelection, make_selection


def selected_demonstrations(
    study: StudyContext, wanted: WantedSelection, corrected: Sequence[str] = ()
) -> Demonstrations:
    """Read a selection's trajectories from the lake as demonstrations, then the corrections of networks by their ids.

    Corrections are drawn as often as anything else, but no more often than the study's `most_share` allows.
    """
    pool, selection = study.pool(wanted.pool), make_selection(study, wanted)
    more = study.lake.query("study/corrections", networks=list(corrected), **pool.partition)
    steps, weight = selection.kept["steps"].to_pylist(), selection.kept["weight"]
    data = demonstrations(
        pool.robot,
        pool.scene,
        [*selected_waypoints(study, selection, pool.partition), *waypoint_arrays(more["q"])],
        positions(study, pool, [*selection.kept["target_id"].to_pylist(), *more["target_id"].to_pylist()]),
        study.config.training,
        steps=[kept if kept is None else np.array(kept, dtype=np.int64) for kept in steps]
        + [None] * len(more),
        weights=None
        if weight.null_count == len(weight)
        else np.concatenate([weight.to_numpy(), np.ones(len(more))]),
    )
    return limited_share(data, len(selection.kept), study.config.corrections.most_share)


def positions(study: StudyContext, pool: PoolContext, target_ids: Sequence[int]) -> FloatArray:
    """Positions (k, 3), m, of training targets."""
    rows = study.lake.query("pool/targets", targets=None, **pool.partition).to_pylist()
    position = {row["target_id"]: [row["x"], row["y"], row["z"]] for row in rows}
    return np.array([position[target] for target in target_ids])


def selected_waypoints(
    study: StudyContext, selection: Selection, partition: dict[str, str]
) -> list[FloatArray]:
    """Waypoints of a selection's trajectories: the selection's own where it has some, else the lake's."""
    if selection.kept["q"].null_count:
        return load_waypoints(study.lake, partition, selection.ids)
    return waypoint_arrays(selection.kept["q"])
