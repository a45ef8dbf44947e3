"""Evaluate: roll trained policies out on test targets, all networks and all tests at once."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import torch

from plancurate import native
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.tasks.learning.failures import COLLIDED, LIMITS, LOST, collision_detail, limits_detail
from plancurate.tasks.learning.observations import layout, observe, state_at
from plancurate.tasks.learning.policies.acting import ActingStack, require_layout
from plancurate.tasks.learning.policies.trained import TrainedPolicy
from plancurate.tasks.learning.settings import EvaluateSettings
from plancurate.tasks.learning.test_targets import TargetsUnderTest

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

REVISION = 2
"""Raise it when tests, their goals or rollouts come out otherwise than before: the ids of evaluations hold it."""


class Trials:
    """What has happened so far in b rollouts.

    A trial is scored until its tool reaches the target, a move breaks a rule (then the robot stays where it
    was and the trial has failed) or the steps run out; its distances and lengths are those of that moment. A
    trial that has reached its target moves on unscored, to show whether it settles there.
    """

    def __init__(
        self,
        robot: Robot,
        scene: Scene,
        targets: FloatArray,
        settings: EvaluateSettings,
        dt: float,
        goals: FloatArray | None = None,
    ) -> None:
        """Begin at the robot's home; targets (b, 3) are positions of the tool, goals (b, n) joint angles.

        `dt` is the time that a move takes, s: what it may be long by the joints' velocity limits.
        """
        b = len(targets)
        self.robot, self.scene, self.settings, self.dt = robot, scene, settings, dt
        self.longest = dt * robot.velocity
        home = np.tile(robot.home, (b, 1))
        self.state = state_at(robot, scene, home, targets, previous_q=home, goal=goals)
        self.reached = self.distance() < settings.reach_m
        self.collided, self.out_of_limits, self.stopped = (np.zeros(b, dtype=bool) for _ in range(3))
        self.refused = home  # the joint angles asked for by the move that ended a trial
        self.steps = np.zeros(b, dtype=np.int32)
        self.final_distance = self.distance()
        self.path_length, self.joint_movement = np.zeros(b), np.zeros(b)

    def distance(self) -> FloatArray:
        """Distances (b,) of the tool from the target now, m."""
        return np.asarray(np.linalg.norm(self.state.target_offset, axis=1))

    def move(self, q: FloatArray) -> None:
        """Go to joint angles q (b, n), as far as each trial may."""
        scored = ~(self.reached | self.stopped)
        now, asked = self.state.q, q
        with np.errstate(invalid="ignore"):
            lower = np.maximum(self.robot.lower, now - self.longest)
            inside = ((q >= lower) & (q <= np.minimum(self.robot.upper, now + self.longest))).all(axis=1)
        q = np.where((inside & ~self.stopped)[:, None], q, now)
        free = self._free(now, q)
        self.out_of_limits |= scored & ~inside
        self.collided |= scored & ~free
        broken = scored & ~(inside & free)
        self.refused = np.where(broken[:, None], asked, self.refused)
        self.stopped |= ~(inside & free)
        self._arrive(np.where(free[:, None], q, now), scored & ~self.stopped)

    def _free(self, now: FloatArray, q: FloatArray) -> BoolArray:
        """Whether each way (b,) from joint angles `now` to q (b, n) is free; who stays is where it was free to go."""
        moving = np.flatnonzero((q != now).any(axis=1))
        free = np.ones(len(q), dtype=bool)
        free[moving] = native.edge_is_free(
            self.robot.native, self.scene.native, now[moving], q[moving], self.settings.resolution
        )
        return free

    def _arrive(self, q: FloatArray, scored: BoolArray) -> None:
        before, self.state = self.state, self.state.after(q)
        way = self.state.tool[:, :3, 3] - before.tool[:, :3, 3]
        self.path_length += scored * np.linalg.norm(way, axis=1)
        self.joint_movement += scored * np.abs(q - before.q).sum(axis=1)
        self.steps += scored
        self.final_distance = np.where(scored, self.distance(), self.final_distance)
        self.reached |= scored & (self.final_distance < self.settings.reach_m)

    def failure(self) -> npt.NDArray[np.object_]:
        """Why each trial (b,) has failed: "collided", "limits" or "lost"; "" for a success."""
        ends = [self.reached, self.collided, self.out_of_limits]
        return np.select(ends, ["", COLLIDED, LIMITS], LOST).astype(object)

    def failure_details(self) -> npt.NDArray[np.object_]:
        """What each trial (b,) collided with first, or which joint's limit it broke; "" for all others."""
        details = np.full(len(self.steps), "", dtype=object)
        for i in np.flatnonzero(self.collided):
            edge = self.state.q[i], self.refused[i]
            details[i] = collision_detail(self.robot, self.scene, *edge, self.settings.resolution)
        for i in np.flatnonzero(self.out_of_limits):
            details[i] = limits_detail(self.robot, self.state.q[i], self.refused[i], self.dt)
        return details

    def columns(self) -> dict[str, npt.NDArray[np.generic]]:
        """One value a trial for each measured column."""
        distance = self.distance()
        return {
            "success": self.reached,
            "reached": self.reached,
            "failure": self.failure(),
            "failure_detail": self.failure_details(),
            "settled": (distance < self.settings.reach_m) & ~self.stopped,
            "precise": (distance < self.settings.precise_m) & ~self.stopped,
            "collided": self.collided,
            "out_of_limits": self.out_of_limits,
            "steps": self.steps,
            "final_distance": self.final_distance,
            "settled_distance": distance,
            "path_length": self.path_length,
            "joint_movement": self.joint_movement,
        }


def roll_out(
    policies: Sequence[TrainedPolicy],
    robot: Robot,
    scene: Scene,
    tests: TargetsUnderTest,
    settings: EvaluateSettings,
    dt: float,
    goals: FloatArray | None = None,
) -> list[pa.Table]:
    """Roll every policy out on every test from the robot's home; gives a table of trials for each policy.

    All policies are of one kind and of the same sizes, as `train` returns them; each sees the terms that it was
    trained on, and PlancurateError says so where these are not alike or are others for this robot. `goals`
    (policies, tests, n) are joint angles to end at, for terms that need them. The policy's next joint angles
    become the next state, `dt` s later. Columns: test_id, kind, target_id, distance_cm, x, y, z of the test, hard where
    it is known; success (reached with every move up to then inside the position and velocity limits and free),
    reached (the same, since a rule broken before ends the trial), collided and out_of_limits (which rule ended it),
    failure (collided, limits or lost) and failure_detail (the first contact; the joint and its limit), settled and
    precise (within reach_m and precise_m at the step limit, with no rule broken on the way); steps,
    final_distance, path_length and joint_movement when the scored part ended; settled_distance at the step limit.
    """
    (trials,) = deque(moves(policies, robot, scene, tests.position, settings, dt, goals), maxlen=1)
    shape = (len(policies), len(tests))
    columns = {name: value.reshape(shape) for name, value in trials.columns().items()}
    return [
        trial_table(tests, {name: value[s] for name, value in columns.items()}) for s in range(len(policies))
    ]


def moves(
    policies: Sequence[TrainedPolicy],
    robot: Robot,
    scene: Scene,
    positions: FloatArray,
    settings: EvaluateSettings,
    dt: float,
    goals: FloatArray | None = None,
) -> Iterator[Trials]:
    """Roll every policy out to every position (t, 3), m, as `roll_out` does; gives the trials, first where they begin.

    What is given is the same object each time, one move later: policies one after another, each at all positions.
    It ends after the settings' steps, or when nothing moves any more.
    What policies draw, they draw by the settings' seed and no other.
    """
    stack = ActingStack(policies, settings.device)
    terms = [name for name, _ in policies[0].layout]
    require_layout(policies[0], layout(terms, robot))
    goals = None if goals is None else goals.reshape(-1, robot.dof)
    trials = Trials(robot, scene, np.tile(positions, (len(policies), 1)), settings, dt, goals)
    shape = (len(policies), len(positions), -1)
    draws = torch.Generator().manual_seed(settings.seed).get_state()
    seen = observe(terms, trials.state)
    yield trials
    for _ in range(settings.max_steps):
        observations = torch.from_numpy(seen).view(shape)
        q = torch.from_numpy(trials.state.q).view(shape)
        with torch.random.fork_rng(devices=[]):  # policies draw from torch's global generator
            torch.set_rng_state(draws)
            asked = stack.next_q(observations, q)
            draws = torch.get_rng_state()
        trials.move(asked.flatten(0, 1).numpy())
        yield trials
        moving = np.flatnonzero(~trials.stopped)  # what a trial that moves no more would see decides nothing
        if len(moving) == 0:
            return
        seen[moving] = observe(terms, trials.state.take(moving))


def trial_table(tests: TargetsUnderTest, measured: dict[str, npt.NDArray[np.generic]]) -> pa.Table:
    """Trials of one policy: the tests' columns and the measured ones."""
    return pa.table(tests.columns() | measured)
