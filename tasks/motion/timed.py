"""A path as a motion: timed as a planned one is."""

from __future__ import annotations

from plancurate.errors import PlancurateError
from plancurate.robots import Robot, Scene
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.settings import GenerateSettings, TimingSettings
from plancurate.tasks.candidates.time_parameterisation import time_path
from plancurate.tasks.learning.policies import TrainedPolicy
from plancurate.tasks.learning.settings import EvaluateSettings
from plancurate.tasks.motion.motion import Motion, sampled
from plancurate.tasks.motion.rollout import goals_of, policy_paths


def timed_motion(robot: Robot, scene: Scene, path: FloatArray, settings: TimingSettings) -> Motion:
    """Waypoints (w, n), rad, as a motion from rest to rest; PlancurateError says why they can't be timed."""
    timed = time_path(robot, scene, path, settings)
    if timed.reason:
        raise PlancurateError(f"not timed: {timed.reason}")
    return sampled(robot, timed.q, settings.dt)


def rollout_motion(
    policy: TrainedPolicy,
    robot: Robot,
    scene: Scene,
    position: FloatArray,
    candidates: GenerateSettings,
    evaluation: EvaluateSettings,
    seed: int,
) -> Motion:
    """A policy's rollout from home to a position (3,), m, timed; the seed is that of its goal, if it observes one.

    PlancurateError for a rollout that does not come near, or that can't be timed.
    """
    goals = goals_of(policy, robot, scene, position[None], candidates.targets, seed)
    (found,) = policy_paths(policy, robot, scene, position[None], evaluation, candidates.timing.dt, goals)
    if found.reason:
        raise PlancurateError(f"rollout: {found.reason}")
    return timed_motion(robot, scene, found.path, candidates.timing)
