"""A pool's trajectories as episodes, with what selections keep of them: what every format is written from."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pyarrow.compute as pc

from plancurate.errors import PlancurateError
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.tasks.curation.pool import FloatArray, Pool, columns, waypoint_arrays
from plancurate.tasks.curation.selectors.selection import Selection
from plancurate.tasks.learning.demonstrations import Demonstrations, demonstrations
from plancurate.tasks.learning.settings import TrainSettings

BoolArray = npt.NDArray[np.bool_]
JOINTS = "joint_positions"
"""The term that every format keeps apart: the robot's own state."""
NAMES = ("trajectory_id", "target_id", "planner", "run", "goal_index", "way", "multiplicity")
MEASURES = ("joint_movement", "smoothness", "path_length", "duration", "final_distance")


@dataclass(frozen=True, eq=False)
class Marks:
    """What one selection says of the episodes."""

    selection: Selection
    rows: pa.Table
    """One row an episode: kept, score, rank, weight; the last three are null where the selection has none."""
    steps: BoolArray | None
    """(frames,): where it lets training windows begin; None for a selection of whole episodes."""

    @property
    def name(self) -> str:
        """The selection's id."""
        return self.selection.selection_id

    @property
    def kept(self) -> list[int]:
        """Numbers of the episodes that it keeps."""
        return np.flatnonzero(self.rows["kept"].to_numpy()).tolist()


@dataclass(frozen=True, eq=False)
class Episodes:
    """All candidates of a pool, then what selections made of them where they do more than choose."""

    robot: Robot
    scene: Scene
    dt: float
    """Seconds from a frame to the next."""
    data: Demonstrations
    """Each episode's waypoints, with one more held step at its end: the state after the last action."""
    about: pa.Table
    """One row an episode: NAMES, MEASURES (null where a selection made it) and `made_by` (a selection's id or null)."""
    marks: tuple[Marks, ...]

    @property
    def lengths(self) -> npt.NDArray[np.int64]:
        """(episodes,): frames of each, which are its waypoints."""
        return self.data.lengths - 1

    @property
    def frames(self) -> npt.NDArray[np.int64]:
        """(frames,): steps of `data` that are frames; the step after each shows the state that follows."""
        return np.concatenate(
            [start + np.arange(length) for start, length in zip(self.data.starts, self.lengths, strict=True)]
        )

    def terms(self) -> Iterator[tuple[str, npt.NDArray[np.float32]]]:
        """Name and columns (steps, k) of each observed term."""
        ends = np.cumsum([size for _, size in self.data.layout])
        for (name, size), end in zip(self.data.layout, ends, strict=True):
            yield name, self.data.observations[:, end - size : end]


def make_episodes(
    robot: Robot,
    scene: Scene,
    pool: Pool,
    selections: Sequence[Selection],
    waypoints: Callable[[Sequence[str]], list[FloatArray]],
    terms: Sequence[str],
) -> Episodes:
    """Lay out a pool and selections of it; `terms` are observed beside the joint angles.

    `waypoints` reads those of trajectories by id. PlancurateError for a selection of other candidates, or for
    trajectories that are not sampled alike.
    """
    for selection in selections:
        _require_of(pool, selection)
    making = [selection for selection in selections if not selection.kept["q"].null_count]
    about = pa.concat_tables([_candidates(pool), *(_made(pool, selection) for selection in making)])
    trajectories = [
        *waypoints(pool.candidates["trajectory_id"].to_pylist()),
        *(q for selection in making for q in waypoint_arrays(selection.kept["q"])),
    ]
    position = dict(zip(pool.targets["target_id"].to_pylist(), columns(pool.targets, "xyz"), strict=True))
    settings = TrainSettings(observation=(JOINTS, *(term for term in terms if term != JOINTS)))
    targets = np.array([position[target] for target in about["target_id"].to_pylist()])
    return Episodes(
        robot=robot,
        scene=scene,
        dt=_dt(pool),
        data=demonstrations(robot, scene, trajectories, targets, settings, hold_steps=1),
        about=about,
        marks=tuple(_marks(about, selection, trajectories) for selection in selections),
    )


def _require_of(pool: Pool, selection: Selection) -> None:
    if selection.pool_hash != pool.hash:
        raise PlancurateError(
            f"selection {selection.selection_id} is of other candidates ({selection.pool_hash}) than those of "
            f"pool {pool.partition['pool']} ({pool.hash}); export it alone"
        )


def _dt(pool: Pool) -> float:
    steps = pc.unique(pool.candidates["dt"]).to_pylist()
    if len(steps) > 1:
        raise PlancurateError(f"pool {pool.partition['pool']}: its steps last {min(steps)} to {max(steps)} s")
    return float(steps[0])


def _candidates(pool: Pool) -> pa.Table:
    """What `Episodes.about` says of the pool's own."""
    rows = pool.candidates.select([*NAMES, *MEASURES])
    return rows.append_column("made_by", pa.nulls(len(rows), pa.string()))


def _made(pool: Pool, selection: Selection) -> pa.Table:
    """What it says of the trajectories that a selection made, by the candidates that it made them of."""
    ids = pool.candidates["trajectory_id"]
    rows = _candidates(pool).take(pc.index_in(selection.kept["trajectory_id"], value_set=ids))
    for name in MEASURES:
        rows = rows.set_column(rows.column_names.index(name), name, pa.nulls(len(rows), pa.float64()))
    made_by = pa.repeat(pa.scalar(selection.selection_id), len(rows))
    return rows.set_column(rows.column_names.index("made_by"), "made_by", made_by)


def _marks(about: pa.Table, selection: Selection, trajectories: Sequence[FloatArray]) -> Marks:
    own = None if selection.kept["q"].null_count else selection.selection_id
    kept = selection.kept
    place = {name: row for row, name in enumerate(kept["trajectory_id"].to_pylist())}
    taken = [
        place.get(name) if made_by == own else None
        for name, made_by in zip(
            about["trajectory_id"].to_pylist(), about["made_by"].to_pylist(), strict=True
        )
    ]
    rows = kept.select(["score", "rank", "weight"]).take(pa.array(taken, pa.int64()))
    rows = rows.add_column(0, "kept", pa.array([row is not None for row in taken]))
    steps = kept["steps"].to_pylist()
    if not any(step is not None for step in steps):
        return Marks(selection, rows, None)
    begin = [
        np.zeros(len(q), bool) if row is None else _allowed(steps[row], len(q))
        for row, q in zip(taken, trajectories, strict=True)
    ]
    return Marks(selection, rows, np.concatenate(begin))


def _allowed(steps: Sequence[int] | None, length: int) -> BoolArray:
    """Which of so many waypoints are among the steps; None stands for all."""
    return np.ones(length, bool) if steps is None else np.isin(np.arange(length), steps)
