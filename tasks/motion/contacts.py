"""Whether the arm touches itself or the scene, at the samples and between them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from plancurate import native
from plancurate.robots import Robot, Scene, colliding_pairs
from plancurate.robots.scene import empty_scene, native_scene
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.playback import world_of_thread
from plancurate.tasks.motion.limits import Found
from plancurate.tasks.motion.settings import MotionSettings
from plancurate.tasks.motion.violations import Check, Violation

LOOKED_AT = 20  # states of a stretch in collision of which it is said what touches, and how deep


def judged_scene(scene: Scene, settings: MotionSettings) -> Scene:
    """The scene with the margin that the motion must leave."""
    margin = settings.kept_margin * scene.margin
    return replace(scene, margin=margin, native=native_scene(scene.shapes, scene.ground, margin))


def collisions(robot: Robot, scene: Scene, t: FloatArray, q: FloatArray) -> list[Violation]:
    """What touches, or comes nearer than the scene's margin, in states q (t, n) at times t (t,).

    The arm is looked at for itself and in the scene: links that meet while another lies on the table are found too.
    """
    q = np.ascontiguousarray(q)
    alone = native.is_free(robot.native, empty_scene(scene.margin).native, q)
    apart = native.is_free(robot.native_without_pairs, scene.native, q)
    bad = [*stretches(~alone), *stretches(~apart)]
    looked_at = sorted(
        {state for begin, end in bad for state in range(begin, end, -(-(end - begin) // LOOKED_AT))}
    )
    if not looked_at:
        return []
    seen: dict[str, list[float]] = {}
    for state in looked_at:
        for pair in colliding_pairs(robot, scene, q[state]):
            seen.setdefault(pair, []).append(float(t[state]))
    depths = depths_of(robot, scene, q[looked_at])
    return [collision(scene, times[0], times[-1], pair, depths.get(pair)) for pair, times in seen.items()]


def collision(scene: Scene, begin: float, end: float, pair: str, depth: float | None) -> Violation:
    """Describe two things that are too near at `begin`, s, first and at `end` last."""
    parts = {"ground", *(entry.name for entry in scene.shapes)}
    check: Check = "scene collision" if pair.rpartition(" and ")[2] in parts else "self-collision"
    how = f"by up to {depth:.4f} m" if depth else f"or come nearer than {scene.margin:g} m"
    message = f"{pair} collide {how}, until about {end:.2f} s"
    return Violation(check, begin, pair, message, depth, 0.0, "m")


def stretches(bad: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Iterator[tuple[int, int]]:
    """Begin and end (exclusive) of every run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], bad, [False]])))
    yield from zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)


def depths_of(robot: Robot, scene: Scene, q: FloatArray) -> dict[str, float]:
    """How deep, m, pairs of things go into each other at most, by PyBullet, in states q (k, n)."""
    world = world_of_thread()
    world.build(robot, scene)
    depths: dict[str, float] = {}
    for state in q.tolist():
        for contact in world.touching(state):
            for pair in (f"{contact.first} and {contact.second}", f"{contact.second} and {contact.first}"):
                depths[pair] = max(depths.get(pair, 0.0), -contact.distance)
    return depths


def clearance(robot: Robot, scene: Scene, t: FloatArray, q: FloatArray, settings: MotionSettings) -> Found:
    """The least distance of the arm from obstacles and floor, and whether it is enough."""
    distances = native.clearance(robot.native_without_pairs, scene.native, np.ascontiguousarray(q))
    least, wanted = float(distances.min()), settings.min_clearance_m
    if not np.isfinite(least):
        return [], {}
    violations = []
    if least < wanted:
        message = f"the arm comes within {least:.4f} m of obstacles or floor where {wanted:g} m must be left"
        when = float(t[(distances < wanted).argmax()])
        violations.append(Violation("clearance", when, "", message, least, wanted, "m"))
    return violations, {"least clearance m": least}
