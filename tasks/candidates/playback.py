"""The judge: does a trajectory keep the robot's limits, and does the arm follow when PyBullet plays it?"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from plancurate import native
from plancurate.robots import Robot, Scene
from plancurate.robots.scene import native_scene
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.limits import limit_problem
from plancurate.tasks.candidates.payload import Payload
from plancurate.tasks.candidates.settings import VerifySettings
from plancurate.tasks.candidates.simulation import Contact, Drives, World

APART = 0.002  # m that the kernel must see between two things for PyBullet not to be asked whether they touch
FULL_EFFORT = 0.999  # of a joint's effort limit; at or above it counts as saturated


@dataclass(frozen=True)
class Verification:
    """How a trajectory did: inside its limits and in physics; `reason` is empty when `verified`."""

    verified: bool
    max_tracking_error_rad: float  # largest joint error on the way, m for a prismatic joint
    final_tracking_error_m: float  # the tool's distance from its goal after holding
    contacts: int  # steps in which something touched that may not
    saturated_share: float  # of joints and steps, at the effort limit
    reason: str


@dataclass(frozen=True, eq=False)
class Playback:
    """What happened in s steps: references, joint states and torques (s,n), and what touched after each."""

    wanted: FloatArray
    q: FloatArray
    torque: FloatArray
    touching: tuple[tuple[Contact, ...], ...]


_of_thread = threading.local()


def verify(robot: Robot, scene: Scene, q: FloatArray, dt: float, settings: VerifySettings) -> Verification:
    """Play waypoints `q` (m,n) that follow each other by `dt` seconds; the same input gives the same numbers.

    Safe from several threads at once: each has a simulation of its own. Raise ValueError for a wrong shape.
    """
    if q.ndim != 2 or q.shape[0] < 2 or q.shape[1] != robot.dof:
        raise ValueError(f"q has shape {q.shape}; (waypoints, at least 2, {robot.dof}) is needed")
    q = np.asarray(q, dtype=np.float64)
    return judge(robot, q, dt, play(robot, scene, q, dt, settings), settings)


def judge(robot: Robot, q: FloatArray, dt: float, played: Playback, settings: VerifySettings) -> Verification:
    """Say of waypoints `q` (m,n) that follow each other by `dt` seconds, and were played, whether both are fine."""
    tools = native.fk(robot.native, np.stack([played.q[-1], played.wanted[-1]]))[:, :3, 3]
    tracking = float(np.abs(played.q - played.wanted).max())
    final = float(np.linalg.norm(tools[0] - tools[1]))
    contacts = sum(1 for touching in played.touching if touching)
    saturated = float((np.abs(played.torque) >= FULL_EFFORT * robot.effort).mean())
    reason = (
        _contact_reason(played, settings)
        or limit_problem(robot, q, dt)
        or _tracking_reason(tracking, final, saturated, settings)
    )
    return Verification(not reason, tracking, final, contacts, saturated, reason)


def play(robot: Robot, scene: Scene, q: FloatArray, dt: float, settings: VerifySettings) -> Playback:
    """Simulate waypoints `q` (m,n), joined by cubics that start and end at rest, and hold the last one."""
    path = rest_to_rest(np.arange(len(q), dtype=np.float64) * dt, q, dt)
    wanted = references(path, 0.0, (len(q) - 1) * dt, settings)
    return follow(robot, scene, wanted, settings, settings.payload)


def rest_to_rest(times: FloatArray, q: FloatArray, spacing: float | FloatArray) -> CubicHermiteSpline:
    """Cubics from rest to rest through waypoints `q` (m,n) at `times` (m,), s, whose spacing is one or the times."""
    velocity = np.gradient(q, spacing, axis=0)
    velocity[[0, -1]] = 0.0
    return CubicHermiteSpline(times, q, velocity)


def references(
    path: Callable[[FloatArray], FloatArray], start: float, end: float, settings: VerifySettings
) -> FloatArray:
    """Joint positions (s+1,n) before the first and after each of s steps from `start` to `end`, s, held at the end."""
    steps = int(np.ceil((end - start + settings.hold_s) * settings.frequency_hz))
    return np.asarray(path(np.minimum(start + np.arange(steps + 1) / settings.frequency_hz, end)))


def follow(
    robot: Robot, scene: Scene, wanted: FloatArray, settings: VerifySettings, payload: Payload | None = None
) -> Playback:
    """Simulate the drives following the references `wanted` (s+1,n), the first of which is where the robot rests.

    First without shapes, in half the time. Only where those states come near anything, PyBullet looks for contacts in
    a world of everything; for all others that world would give the same numbers to the last bit, and no contact.
    """
    step_s = 1.0 / settings.frequency_hz
    alone = drive(lone_arm_of_thread(robot, step_s, payload), robot, wanted, settings)
    if keeps_apart(robot, scene, np.concatenate([wanted[:1], alone.q])):
        return alone
    world = world_of_thread()
    world.build(robot, scene, step_s, payload)
    return drive(world, robot, wanted, settings)


def drive(world: World, robot: Robot, wanted: FloatArray, settings: VerifySettings) -> Playback:
    """Let the drives of the world's robot follow the references `wanted` (s+1,n)."""
    world.place(wanted[0].tolist())
    gains = ([gain] * robot.dof for gain in (settings.position_gain, settings.velocity_gain))
    drives = Drives(robot.effort.tolist(), *gains)
    speed = np.diff(wanted, axis=0) * settings.frequency_hz
    q: list[float] = []  # all steps one after another: nothing for the garbage collector to go through
    torque: list[float] = []
    touching: list[tuple[Contact, ...]] = []
    for position, velocity in zip(wanted[:-1].tolist(), speed.tolist(), strict=True):
        for state in world.step(drives, position, velocity):
            q.append(state[0])
            torque.append(state[3])
        touching.append(world.contacts())
    shape = (len(touching), robot.dof)
    return Playback(wanted[1:], np.reshape(q, shape), np.reshape(torque, shape), tuple(touching))


def keeps_apart(robot: Robot, scene: Scene, q: FloatArray) -> bool:
    """Whether the kernel calls all states `q` (s,n) farther than APART from any contact that PyBullet could see."""
    if not np.isfinite(q).all():
        return False
    around = native_scene(scene.shapes, scene.ground, APART)
    return bool(native.is_free(robot.native, around, q).all())


def world_of_thread() -> World:
    """The thread's own world: whoever builds it finds it empty of what others built."""
    if not hasattr(_of_thread, "world"):
        _of_thread.world = World()
    world: World = _of_thread.world
    return world


def lone_arm_of_thread(robot: Robot, step_s: float, payload: Payload | None) -> World:
    """The thread's own world with this robot alone, built where another was in it."""
    content = (robot.digest, step_s, payload)
    if getattr(_of_thread, "alone", None) != content:
        if not hasattr(_of_thread, "lone_arm"):
            _of_thread.lone_arm = World()
        _of_thread.lone_arm.build_alone(robot, step_s, payload)
        _of_thread.alone = content
    world: World = _of_thread.lone_arm
    return world


def _contact_reason(played: Playback, settings: VerifySettings) -> str:
    for step, touching in enumerate(played.touching, start=1):
        if touching:
            return (
                f"{touching[0].first} touches {touching[0].second} after {step / settings.frequency_hz:.2f} s"
            )
    return ""


def _tracking_reason(tracking: float, final: float, saturated: float, settings: VerifySettings) -> str:
    """Say which threshold is not kept; a simulation that blew up (not a number) keeps none."""
    if not tracking <= settings.max_tracking_error_rad:
        return f"tracking error {tracking:.3f} rad exceeds {settings.max_tracking_error_rad:g}"
    if not final <= settings.max_final_error_m:
        return f"tool ends {final:.4f} m from its goal, more than {settings.max_final_error_m:g}"
    if saturated > settings.max_saturated_share:
        limit = settings.max_saturated_share
        return f"joints at their effort limit for {saturated:.3f} of all steps, more than {limit:g}"
    return ""
