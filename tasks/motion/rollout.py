"""Paths that a trained policy takes to targets."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from plancurate.robots import Robot, Scene
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.settings import TargetSettings
from plancurate.tasks.learning.failures import COLLIDED, LIMITS
from plancurate.tasks.learning.policies import TrainedPolicy
from plancurate.tasks.learning.rollouts import Trials, moves
from plancurate.tasks.learning.settings import EvaluateSettings
from plancurate.tasks.learning.training_goals import chosen_goals


@dataclass(frozen=True, eq=False)
class PolicyPath:
    """Where a policy went from home: waypoints (w, n), rad, up to the one nearest to the target."""

    path: FloatArray
    distance_m: float
    """Of the last waypoint's tool from the target."""
    reason: str
    """Why it is of no use; empty for one that comes near enough."""


def policy_paths(
    policy: TrainedPolicy,
    robot: Robot,
    scene: Scene,
    positions: FloatArray,
    settings: EvaluateSettings,
    dt: float,
    goals: FloatArray | None,
) -> list[PolicyPath]:
    """Roll a policy out to positions (t, 3), m, all at once; it goes on after it has come near, while it may.

    Goals (t, n) are for policies that observe some.
    """
    states, distances = [], []
    for trials in moves([policy], robot, scene, positions, settings, dt, goals):
        states.append(trials.state.q)
        distances.append(trials.distance())
    return [
        policy_path(trials, test, np.array(states)[:, test], np.array(distances)[:, test], settings.reach_m)
        for test in range(len(positions))
    ]


def policy_path(
    trials: Trials, test: int, states: FloatArray, distances: FloatArray, reach_m: float
) -> PolicyPath:
    """The path of one trial, from states (k, n) with their distances (k,) from the target."""
    last = int(distances.argmin())
    nearest = float(distances[last])
    reason = "" if nearest < reach_m else missed(trials, test, nearest)
    return PolicyPath(states[: last + 1], nearest, reason)


def missed(trials: Trials, test: int, nearest: float) -> str:
    """Why a rollout did not come near its target."""
    failure, detail = str(trials.failure()[test]), str(trials.failure_details()[test])
    ended = {COLLIDED: f"it ran into a collision ({detail})", LIMITS: f"it broke a limit ({detail})"}
    return f"came no nearer than {nearest:.3f} m: {ended.get(failure, 'its steps ran out')}"


def proposals(policy: TrainedPolicy, count: int) -> list[TrainedPolicy]:
    """The ways to act that a policy offers, as policies."""
    return [replace(policy, policy=kind) for kind in policy.policy.proposals(count)]


def goals_of(
    policy: TrainedPolicy,
    robot: Robot,
    scene: Scene,
    positions: FloatArray,
    targets: TargetSettings,
    seed: int,
) -> FloatArray | None:
    """Joint angles (t, n) to end at, by what the policy was shown; None for one that observes none.

    What a position's goal is searched by is drawn by the seed and its place among the positions.
    """
    if policy.goals is None:
        return None
    seeds = [(seed, place) for place in range(len(positions))]
    return chosen_goals(policy.goals, robot, scene, positions, targets, seeds)
