"""Joint trajectories that somebody else recorded, as candidates: checked and played back as they are."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import pyarrow as pa

from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.generate import named, pool_id, run_row
from plancurate.tasks.candidates.postprocess import postprocess
from plancurate.tasks.candidates.settings import GenerateSettings
from plancurate.tasks.candidates.sources import PlannedPath
from plancurate.tasks.candidates.sources.recorded import SOURCE
from plancurate.tasks.candidates.targets import Target
from plancurate.tasks.candidates.time_parameterisation import as_sampled
from plancurate.tasks.lake.schema import table


@dataclass(frozen=True, eq=False)
class Episode:
    """Joint states `q` (m, n), rad (m for a sliding joint), all float32 numbers, and where its frames say to go."""

    name: str
    q: FloatArray
    target: FloatArray | None
    """(3,), m; None where the set says nothing of it: then it is where the tool ends."""


@dataclass(frozen=True, eq=False)
class RecordedSet:
    """Episodes in their order, `dt` s from a frame to the next."""

    dt: float
    episodes: tuple[Episode, ...]


Grouped = Sequence[tuple[Target, Sequence[Episode]]]
"""Targets, each with the episodes that lead there."""


def require_sound(robot: Robot, recorded: RecordedSet) -> None:
    """Raise PlancurateError, naming the first episode with a fault, where a set can't be joint trajectories."""
    if not recorded.episodes:
        raise PlancurateError("the set holds no episode")
    if not 0 < recorded.dt < float("inf"):
        raise PlancurateError(f"a frame lasts {recorded.dt:g} s; seconds above 0 would be right")
    for episode in recorded.episodes:
        if len(episode.q) < 2:
            raise PlancurateError(f"{episode.name}: a motion has two frames or more")
        if not np.isfinite(episode.q).all():
            frame, joint = np.argwhere(~np.isfinite(episode.q))[0]
            raise PlancurateError(
                f"{episode.name}: frame {frame}: {robot.joint_names[joint]} is {episode.q[frame, joint]}"
            )
        if episode.target is not None and not np.isfinite(episode.target).all():
            raise PlancurateError(f"{episode.name}: its target {episode.target} is no position")


def by_target(robot: Robot, recorded: RecordedSet, same_m: float) -> Grouped:
    """Targets in the order in which the episodes first lead there, each with its episodes.

    Episodes lead to the same target where their targets lie within `same_m` of the first one's. A target's goals are
    the joint states that its episodes end in.
    """
    positions: list[FloatArray] = []
    groups: list[list[Episode]] = []
    for episode in recorded.episodes:
        position = tool_at(robot, episode.q[-1]) if episode.target is None else episode.target
        distances = np.linalg.norm(np.reshape(positions, (-1, 3)) - position, axis=1)
        near = int(distances.argmin()) if len(distances) else 0
        if len(distances) and distances[near] <= same_m:
            groups[near].append(episode)
        else:
            positions.append(position)
            groups.append([episode])
    ends = [np.unique([episode.q[-1] for episode in group], axis=0) for group in groups]
    targets = [Target(number, *content) for number, content in enumerate(zip(positions, ends, strict=True))]
    return list(zip(targets, groups, strict=True))


def tool_at(robot: Robot, q: FloatArray) -> FloatArray:
    """Position (3,) of the tool, m, in a joint state (n,)."""
    return np.asarray(native.fk(robot.native, q[None])[0, :3, 3])


def set_id(grouped: Grouped, same_m: float) -> str:
    """Name a set by its content: which motions lead to which targets, whatever format they came in."""
    content = hashlib.sha256(str(same_m).encode())
    for target, episodes in grouped:
        content.update(target.position.astype(np.float32).tobytes())
        for episode in episodes:
            content.update(np.array(episode.q.shape).tobytes() + episode.q.astype(np.float32).tobytes())
    return content.hexdigest()[:12]


def recorded_rows(
    robot: Robot,
    scene: Scene,
    grouped: Grouped,
    settings: GenerateSettings,
    same_m: float,
) -> pa.Table:
    """A row of `trajectories` for each episode, with a reason for one that is no candidate.

    One that ends farther than `same_m` from its target, leaves a limit or touches something is not solved; playback
    decides whether the others are verified.
    """
    check = partial(
        postprocess, robot, scene, timing=settings.timing, playback=settings.verify, timed_by=as_sampled
    )
    pool = pool_id(robot, scene, settings)
    rows = [
        named(
            run_row(robot, target, PlannedPath(run, 0, "exact", episode.q), check, same_m),
            SOURCE,
            pool,
            settings,
        )
        for target, episodes in grouped
        for run, episode in enumerate(episodes)
    ]
    return pa.Table.from_pylist(rows, table("trajectories").schema)
