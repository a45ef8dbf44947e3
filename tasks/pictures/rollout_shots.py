"""Shots of policies on their way to a target: where they end, and where they fail."""

from __future__ import annotations

import numpy as np

from plancurate import native
from plancurate.robots import Robot, Scene, colliding_pairs
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.learning.failures import COLLIDED, LIMITS
from plancurate.tasks.learning.policies import TrainedPolicy
from plancurate.tasks.learning.rollouts import Trials, moves
from plancurate.tasks.learning.settings import EvaluateSettings
from plancurate.tasks.pictures.shot import BAD, GOOD, Run, names_in

PIECES = 200  # of a refused move that are looked at for the first contact


def rollout_run(
    policy: TrainedPolicy,
    robot: Robot,
    scene: Scene,
    position: FloatArray,
    settings: EvaluateSettings,
    dt: float,
    goals: FloatArray | None,
) -> Run:
    """A policy's way from home to a position (3,), m: to where it reaches it, breaks a rule or runs out of steps.

    A step takes `dt`, s; goals (1, n) are for policies that observe some.
    """
    states = []
    for trials in moves([policy], robot, scene, position[None], settings, dt, goals):
        states.append(trials.state.q[0])
    steps, failure = int(trials.steps[0]), str(trials.failure()[0])
    path = np.array(states[: steps + 1])
    touching: frozenset[str] = frozenset()
    if failure == COLLIDED:
        contact, touching = first_contact(robot, scene, path[-1], trials.refused[0])
        path = np.concatenate([path, contact[None]])
    colour = BAD if failure else GOOD
    return Run(
        np.arange(len(path), dtype=np.float64) * dt, path, colour, ended(trials, failure), position, touching
    )


def first_contact(
    robot: Robot, scene: Scene, start: FloatArray, asked: FloatArray
) -> tuple[FloatArray, frozenset[str]]:
    """The first state (n,) between two that is not free, and what touches there."""
    between = start + np.linspace(0, 1, PIECES)[:, None] * (asked - start)
    state = between[int(native.is_free(robot.native, scene.native, between).argmin())]
    return state, names_in(colliding_pairs(robot, scene, state))


def ended(trials: Trials, failure: str) -> str:
    """How the only trial went, in words."""
    detail = str(trials.failure_details()[0])
    away = f"{100 * float(trials.final_distance[0]):.0f} cm from the target"
    if not failure:
        return f"reaches it in {int(trials.steps[0])} steps"
    return {COLLIDED: f"collides: {detail}", LIMITS: f"breaks a limit: {detail}"}.get(
        failure, f"runs out of steps {away}"
    )
