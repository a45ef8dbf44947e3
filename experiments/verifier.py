"""Does the motion verifier refuse clean motions, and does it find faults that are put into them?

Clean are candidates of `free`, `table` and `shelf` that keep their limits and were followed in playback. Each fault is
put into motions of `table`; it counts as found when the check named for it is among the violations, and the table shows
how many of them were refused at all. The tolerances in `tasks/motion/settings.py` were chosen by the first table.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from plancurate import native
from plancurate.robots import Robot, Scene, load_world
from plancurate.robots.scene import empty_scene
from plancurate.tasks.candidates.generate import generate_candidates
from plancurate.tasks.candidates.payload import Payload
from plancurate.tasks.candidates.settings import GenerateSettings
from plancurate.tasks.candidates.targets import sample_targets
from plancurate.tasks.motion.motion import Motion, curve_of
from plancurate.tasks.motion.verify import verify_motion
from plancurate.tasks.motion.violations import Verdict

SCENES = ("free", "table", "shelf")
PLANNERS = ("RRTConnect", "KPIECE1", "PRM", "BiTRRT", "EST")
SETTINGS = GenerateSettings()
HEAVY = Payload(mass_kg=60, centre_m=(0.0, 0.0, 0.1))
Fault = Callable[[Robot, Scene, Motion, np.random.Generator], Verdict]


def clean_motions(robot: Robot, scene: Scene) -> Iterator[Motion]:
    """Verified candidates of one target after another, without end."""
    number = 0
    while True:
        targets = sample_targets(robot, scene, SETTINGS.targets, number, 1)
        for planner in PLANNERS:
            rows, _ = generate_candidates(robot, scene, targets, planner, SETTINGS)
            for row in rows.to_pylist():
                if row["verified"]:
                    q = np.array(row["q"], dtype=np.float64)
                    yield Motion(np.arange(len(q)) * row["dt"], q, joint_names=robot.joint_names)
        number += 1


def position(robot: Robot, scene: Scene, motion: Motion, rng: np.random.Generator) -> Verdict:
    """A joint ends 0.01 rad beyond its range."""
    joint, s = rng.integers(robot.dof), (motion.times / motion.times[-1]) ** 2
    q = motion.positions.copy()
    q[:, joint] += s * (robot.upper[joint] + 0.01 - q[-1, joint])
    return verify_motion(robot, scene, replace(motion, times=motion.times * 20, positions=q))


def speed(robot: Robot, scene: Scene, motion: Motion, rng: np.random.Generator) -> Verdict:
    """The whole motion 1.3 times as fast."""
    return verify_motion(robot, scene, replace(motion, times=motion.times / 1.3))


def acceleration(robot: Robot, scene: Scene, motion: Motion, rng: np.random.Generator) -> Verdict:
    """One sample of one joint is off by what its acceleration limit allows within a step."""
    joint, sample = rng.integers(robot.dof), rng.integers(2, len(motion.times) - 2)
    q = motion.positions.copy()
    q[sample, joint] += robot.acceleration[joint] * SETTINGS.timing.dt**2
    return verify_motion(robot, scene, replace(motion, positions=q))


def jerk(robot: Robot, scene: Scene, motion: Motion, rng: np.random.Generator) -> Verdict:
    """The robot's jerk limit is two thirds of what the motion has."""
    peak = np.abs(curve_of(motion).jerk(np.linspace(0, motion.times[-1], 2000))).max(axis=0)
    return verify_motion(replace(robot, jerk=np.maximum(peak / 1.5, 1e-3)), scene, motion)


def self_collision(robot: Robot, scene: Scene, motion: Motion, rng: np.random.Generator) -> Verdict:
    """Slowly to a state in which links touch."""
    q = rng.uniform(robot.lower, robot.upper, (500_000, robot.dof))
    touching = q[~native.is_free(robot.native, empty_scene().native, q)][0]
    s = np.linspace(0, 1, 200)[:, None]
    path = robot.home + (10 * s**3 - 15 * s**4 + 6 * s**5) * (touching - robot.home)
    return verify_motion(robot, scene, Motion(s[:, 0] * 10, path, joint_names=robot.joint_names))


def between_samples(robot: Robot, scene: Scene, motion: Motion, rng: np.random.Generator) -> Verdict:
    """Two free samples with an obstacle between them."""
    while True:
        a = rng.uniform(robot.lower, robot.upper, (20_000, robot.dof))
        b = np.clip(a + rng.uniform(-0.4, 0.4, a.shape), robot.lower, robot.upper)
        free = native.is_free(robot.native, scene.native, np.concatenate([a, b])).reshape(2, -1).all(axis=0)
        hit = ~native.is_free(robot.native, scene.native, (a + b) / 2)
        hit &= native.clearance(robot.native_without_pairs, scene.native, (a + b) / 2) <= 0
        if (free & hit).any():
            pair = np.stack([a, b])[:, np.flatnonzero(free & hit)[0]]
            return verify_motion(
                robot, scene, Motion(np.array([0.0, 2.0]), pair, joint_names=robot.joint_names)
            )


def payload(robot: Robot, scene: Scene, motion: Motion, rng: np.random.Generator) -> Verdict:
    """The tool carries 60 kg."""
    return verify_motion(robot, scene, motion, payload=HEAVY)


def order(robot: Robot, scene: Scene, motion: Motion, rng: np.random.Generator) -> Verdict:
    """Two joints are exchanged, names and all."""
    exchanged = np.arange(robot.dof)
    i, j = rng.choice(robot.dof, 2, replace=False)
    exchanged[[i, j]] = j, i
    names = tuple(robot.joint_names[k] for k in exchanged)
    return verify_motion(
        robot, scene, replace(motion, positions=motion.positions[:, exchanged], joint_names=names)
    )


def not_a_number(robot: Robot, scene: Scene, motion: Motion, rng: np.random.Generator) -> Verdict:
    """One value is missing."""
    q = motion.positions.copy()
    q[rng.integers(len(q)), rng.integers(robot.dof)] = np.nan
    return verify_motion(robot, scene, replace(motion, positions=q))


def unsorted(robot: Robot, scene: Scene, motion: Motion, rng: np.random.Generator) -> Verdict:
    """Two times that follow each other are exchanged."""
    times, k = motion.times.copy(), rng.integers(len(motion.times) - 1)
    times[[k, k + 1]] = times[[k + 1, k]]
    return verify_motion(robot, scene, replace(motion, times=times))


FAULTS: dict[str, tuple[Fault, set[str]]] = {
    "position limit": (position, {"position"}),
    "speed x 1.3": (speed, {"velocity", "acceleration"}),
    "acceleration": (acceleration, {"acceleration"}),
    "jerk": (jerk, {"jerk"}),
    "self-collision": (self_collision, {"self-collision"}),
    "collision between two samples": (between_samples, {"scene collision"}),
    "torque with payload": (payload, {"torque"}),
    "tracking with payload": (payload, {"tracking"}),
    "joint order": (order, {"joint order"}),
    "not a number": (not_a_number, {"finite"}),
    "unsorted times": (unsorted, {"times"}),
}


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--clean", type=int, default=1000, help="clean motions")
    parser.add_argument("--faulty", type=int, default=30, help="motions with each fault")
    asked = parser.parse_args()
    worlds = {scene: load_world("h2017", scene) for scene in SCENES}
    print("| clean motions in | verified | refused | velocity | acceleration | torque | seconds each |")
    for number, scene in enumerate(SCENES):
        count = (asked.clean + number) // len(SCENES)
        print_clean(scene, worlds[scene], count)
    print("| fault | motions | found | refused |")
    robot, scene_of_faults = worlds["table"]
    rng, source = np.random.default_rng(0), clean_motions(robot, scene_of_faults)
    motions = [next(source) for _ in range(asked.faulty)]
    for name, (fault, checks) in FAULTS.items():
        verdicts = [fault(robot, scene_of_faults, motion, rng) for motion in motions]
        found = sum(bool(checks & {v.check for v in verdict.violations}) for verdict in verdicts)
        refused = sum(not verdict.passed for verdict in verdicts)
        print(f"| {name} | {len(verdicts)} | {found} | {refused} |", flush=True)


def print_clean(scene: str, world: tuple[Robot, Scene], count: int) -> None:
    """Verify clean motions of a scene; print how many were refused, and the greatest shares of limits among them."""
    source, spent, verdicts = clean_motions(*world), 0.0, []
    for _ in range(count):
        motion = next(source)
        start = time.perf_counter()
        verdicts.append(verify_motion(*world, motion))
        spent += time.perf_counter() - start
    refused = [verdict for verdict in verdicts if not verdict.passed]
    shares = [
        f"{max(verdict.measured[f'{name} share'] for verdict in verdicts):.3f}"
        for name in ("velocity", "acceleration", "torque")
    ]
    print(f"| {scene} | {count} | {len(refused)} | {' | '.join(shares)} | {spent / count:.3f} |", flush=True)
    for verdict in refused[:5]:
        print(verdict.text, flush=True)


if __name__ == "__main__":
    main()
