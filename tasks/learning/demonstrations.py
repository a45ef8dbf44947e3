"""Trajectories as demonstrations: what a policy sees at each step and what it should do next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from plancurate.errors import PlancurateError
from plancurate.tasks.learning.arc import resampled, resampled_steps
from plancurate.tasks.learning.observations import Layout, State, goal_terms, layout, observe, state_at
from plancurate.tasks.learning.settings import TrainSettings
from plancurate.tasks.learning.training_goals import TrainingGoals, training_goals

if TYPE_CHECKING:
    from plancurate.robots.robot import Robot
    from plancurate.robots.scene import Scene

FloatArray = npt.NDArray[np.float64]
Float32Array = npt.NDArray[np.float32]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

HOLD_STEPS = 10
"""Held steps at the end of each demonstration unless the caller says otherwise."""


@dataclass(frozen=True, eq=False)
class Demonstrations:
    """Steps of all episodes one after another, with o numbers observed and n joints."""

    layout: Layout
    """Observation terms, and how many of the o numbers each gives."""
    observations: Float32Array
    """(steps, o)."""
    q: Float32Array
    """(steps, n): joint angles, rad (m for a sliding joint)."""
    actions: Float32Array
    """(steps, n): next joint angles minus the present ones; zero where the episode holds."""
    starts: IntArray
    """(episodes,): first step of each episode."""
    lengths: IntArray
    """(episodes,): steps of each episode, held ones included."""
    window_starts: IntArray = field(default_factory=lambda: np.empty(0, np.int64))
    """Steps where a training window may begin; all unless given."""
    window_weights: FloatArray | None = None
    """How often each of them is drawn, in proportion; all alike unless given."""
    goals: TrainingGoals | None = None
    """Where they end, if a term needs a goal."""

    def __post_init__(self) -> None:
        if len(self.window_starts) == 0:
            object.__setattr__(self, "window_starts", np.arange(len(self.observations)))

    @property
    def dof(self) -> int:
        """Number of joints."""
        return int(self.actions.shape[1])

    def windows(self, first: IntArray, length: int) -> IntArray:
        """Steps (k, length) of windows from `first` (k,); beyond the end the held last step is repeated."""
        episode = np.searchsorted(self.starts, first, side="right") - 1
        last = self.starts[episode] + self.lengths[episode] - 1
        return np.asarray(np.minimum(first[:, None] + np.arange(length), last[:, None]))


def demonstrations(
    robot: Robot,
    scene: Scene,
    trajectories: Sequence[FloatArray],
    target_positions: FloatArray,
    settings: TrainSettings = TrainSettings(),
    *,
    hold_steps: int = HOLD_STEPS,
    steps: Sequence[IntArray | None] | None = None,
    weights: FloatArray | None = None,
    seen: Sequence[Float32Array] | None = None,
) -> Demonstrations:
    """Build demonstrations from trajectories, each (m, n), that lead to target_positions (trajectories, 3).

    `settings` say what is observed, and whether trajectories are resampled by arc first. An episode has
    m + hold_steps steps; from the last waypoint on the action is to stay. `steps` names the waypoints of each
    trajectory (None: all) at which a window may begin; it may begin while the robot holds if it may at the last
    waypoint. `weights` (trajectories,) say how much more often windows are drawn. `seen` is what `seen_along` gives,
    where it is known already. Raises PlancurateError when there is nothing to learn from.
    """
    if len(trajectories) == 0:
        raise PlancurateError("demonstrations: 0 trajectories were kept; a policy needs at least one")
    starting = steps or [None] * len(trajectories)
    if settings.demonstration_steps == "arc":
        trajectories, starting = _by_arc(trajectories, starting, settings.arc_rad)
    held = _held(trajectories, hold_steps)
    lengths = np.array([len(q) - 1 for q in held], dtype=np.int64)
    starts = np.cumsum(lengths) - lengths
    begin = [
        np.arange(m) if kept is None else _with_hold(kept, len(q), m)
        for m, q, kept in zip(lengths, trajectories, starting, strict=True)
    ]
    counts = [len(b) for b in begin]
    if not any(counts):
        raise PlancurateError("demonstrations: no step of the kept trajectories was left to learn from")
    goals = None
    if goal_terms(settings.observation):
        goals = training_goals(target_positions, np.stack([q[-1] for q in trajectories]))
    if seen is None:
        seen = _seen(robot, scene, held, target_positions, settings)
    return Demonstrations(
        layout=layout(settings.observation, robot),
        observations=np.concatenate(seen),
        q=np.concatenate([q[:-1] for q in held]).astype(np.float32),
        actions=np.concatenate([np.diff(q, axis=0) for q in held]).astype(np.float32),
        starts=starts,
        lengths=lengths,
        window_starts=np.concatenate([start + b for start, b in zip(starts, begin, strict=True)]),
        window_weights=None if weights is None else np.repeat(weights, counts),
        goals=goals,
    )


def seen_along(
    robot: Robot,
    scene: Scene,
    trajectories: Sequence[FloatArray],
    target_positions: FloatArray,
    settings: TrainSettings = TrainSettings(),
    *,
    hold_steps: int = HOLD_STEPS,
) -> list[Float32Array]:
    """What a policy sees (steps, o) along each trajectory, as `demonstrations` of the same arguments observe it."""
    if settings.demonstration_steps == "arc":
        trajectories = [resampled(q, settings.arc_rad) for q in trajectories]
    return _seen(robot, scene, _held(trajectories, hold_steps), target_positions, settings)


def limited_share(data: Demonstrations, limited: BoolArray, most: float) -> Demonstrations:
    """The demonstrations with those `limited` (episodes,) drawn less often where they were more than `most` of 1."""
    if not limited.any():
        return data
    late = limited[np.searchsorted(data.starts, data.window_starts, side="right") - 1]
    weights = np.ones(len(late)) if data.window_weights is None else data.window_weights
    early, now = float(weights[~late].sum()), float(weights[late].sum())
    allowed = early * most / (1 - most)
    if now <= allowed:
        return data
    return replace(data, window_weights=np.where(late, weights * allowed / now, weights))


def _by_arc(
    trajectories: Sequence[FloatArray], steps: Sequence[IntArray | None], step: float
) -> tuple[list[FloatArray], list[IntArray | None]]:
    """Trajectories resampled by arc, and the waypoints of theirs that stand for those named."""
    moved = [
        None if kept is None else resampled_steps(q, kept, step)
        for q, kept in zip(trajectories, steps, strict=True)
    ]
    return [resampled(q, step) for q in trajectories], moved


def _held(trajectories: Sequence[FloatArray], hold_steps: int) -> list[FloatArray]:
    """Trajectories whose last waypoint is held for so many steps, and once more as the state after the last step."""
    return [np.concatenate([q, np.repeat(q[-1:], hold_steps + 1, axis=0)]) for q in trajectories]


def _seen(
    robot: Robot, scene: Scene, held: Sequence[FloatArray], positions: FloatArray, settings: TrainSettings
) -> list[Float32Array]:
    """What is seen (steps, o) along each of some held trajectories."""
    lengths = [len(q) - 1 for q in held]
    state = _states(robot, scene, held, np.repeat(positions, lengths, axis=0))
    return np.split(observe(settings.observation, state).astype(np.float32), np.cumsum(lengths)[:-1])


def _states(robot: Robot, scene: Scene, held: Sequence[FloatArray], targets: FloatArray) -> State:
    """States at all steps of trajectories that end held, with a target (steps, 3) each; goals are their ends."""
    return state_at(
        robot,
        scene,
        np.concatenate([q[:-1] for q in held]),
        targets,
        previous_q=np.concatenate([np.concatenate([q[:1], q[:-2]]) for q in held]),
        goal=np.concatenate([np.broadcast_to(q[-1], q[1:].shape) for q in held]),
    )


def _with_hold(kept: IntArray, waypoints: int, length: int) -> IntArray:
    """Kept waypoints, and the held steps after the last waypoint if that is kept."""
    held = np.arange(waypoints, length) if waypoints - 1 in kept else np.empty(0, np.int64)
    return np.concatenate([np.asarray(kept, dtype=np.int64), held])
