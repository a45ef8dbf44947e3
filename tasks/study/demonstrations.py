"""What a study's networks learn from: the trajectories of a selection, and corrections."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import pyarrow.compute as pc

from plancurate.robots import Robot, Scene
from plancurate.tasks.curation.pool import FloatArray, load_waypoints, waypoint_arrays
from plancurate.tasks.curation.selectors.selection import Selection
from plancurate.tasks.learning.demonstrations import (
    Demonstrations,
    Float32Array,
    demonstrations,
    limited_share,
    seen_along,
)
from plancurate.tasks.learning.join import join_demonstrations
from plancurate.tasks.learning.settings import TrainSettings
from plancurate.tasks.study.context import PoolContext, StudyContext
from plancurate.tasks.study.scenes import IntArray, rows_by_scene
from plancurate.tasks.study.selections import WantedSelection, make_selection

Observed = dict[str, Float32Array]
"""What a policy sees along trajectories, by their ids."""


@dataclass(frozen=True, eq=False)
class Shown:
    """Trajectories to learn from, as `demonstrations` takes them."""

    names: list[str | None]
    """The ids of those that the lake holds."""
    paths: list[FloatArray]
    positions: FloatArray
    steps: list[IntArray | None]
    weights: FloatArray | None

    def has_steps(self, rows: IntArray) -> bool:
        """Whether any of these trajectories has a step to learn from."""
        return any(self.steps[i] is None or len(self.steps[i]) for i in rows)

    def demonstrations(
        self, robot: Robot, scene: Scene, rows: IntArray, settings: TrainSettings, known: Observed
    ) -> Demonstrations:
        """Demonstrations of these trajectories, which lie in one scene; what is seen along them is added to `known`."""
        return demonstrations(
            robot,
            scene,
            [self.paths[i] for i in rows],
            self.positions[rows],
            settings,
            steps=[self.steps[i] for i in rows],
            weights=None if self.weights is None else self.weights[rows],
            seen=self._seen(robot, scene, rows, settings, known),
        )

    def _seen(
        self, robot: Robot, scene: Scene, rows: IntArray, settings: TrainSettings, known: Observed
    ) -> list[Float32Array]:
        found = {i: known[name] for i in rows if (name := self.names[i]) in known}
        new = [i for i in rows if i not in found]
        if new:
            paths = [self.paths[i] for i in new]
            found |= zip(new, seen_along(robot, scene, paths, self.positions[new], settings), strict=True)
            known.update({name: found[i] for i in new if (name := self.names[i])})
        return [found[i] for i in rows]


def selected_demonstrations(
    study: StudyContext, wanted: WantedSelection, corrected: Sequence[str] = (), cluster: int | None = None
) -> Demonstrations:
    """Read a selection's trajectories from the lake as demonstrations, then the corrections of networks by their ids.

    Those of one cluster alone where it is given. Corrections are drawn as often as anything else, but no more often
    than the study's `most_share` allows.
    """
    pool, selection = study.pool(wanted.pool), make_selection(study, wanted)
    if cluster is not None:
        selection = replace(selection, kept=selection.kept.filter(pc.field("cluster") == cluster))
    more = study.lake.query("study/corrections", networks=list(corrected), **pool.partition)
    steps, weight = selection.kept["steps"].to_pylist(), selection.kept["weight"]
    targets = [*selection.kept["target_id"].to_pylist(), *more["target_id"].to_pylist()]
    own_paths = selection.kept["q"].null_count == 0
    shown = Shown(
        names=[*([None] * len(selection.kept) if own_paths else selection.ids), *[None] * len(more)],
        paths=[*selected_waypoints(study, selection, pool.partition), *waypoint_arrays(more["q"])],
        positions=positions(study, pool, targets),
        steps=[kept if kept is None else np.array(kept, dtype=np.int64) for kept in steps]
        + [None] * len(more),
        weights=None
        if weight.null_count == len(weight)
        else np.concatenate([weight.to_numpy(), np.ones(len(more))]),
    )
    groups = list(rows_by_scene(pool.scenes_of_targets(targets)))
    if len(groups) > 1:  # a selector may have left nothing of what it kept in a scene
        groups = [(scene, rows) for scene, rows in groups if shown.has_steps(rows)]
    settings, known = pool.training(study.config), _observed(study, pool)
    data = [shown.demonstrations(pool.robot, scene, rows, settings, known) for scene, rows in groups]
    is_correction = np.concatenate([rows for _, rows in groups]) >= len(selection.kept)
    joined = data[0] if len(data) == 1 else join_demonstrations(data)
    return limited_share(joined, is_correction, study.config.corrections.most_share)


@lru_cache(maxsize=2)
def _observed(study: StudyContext, pool: PoolContext) -> Observed:
    """What is seen along trajectories of a pool: most selections share most of theirs, all policies learn from each."""
    return {}


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
