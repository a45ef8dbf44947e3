"""Microseconds to plan and to simplify for the Panda by RRTConnect, beside VAMP on the same problems.

    pip install vamp-planner
    python benchmarks/panda.py [--scenes table shelf passage] [--targets 20] [--runs 10] [--resolution 0.01]

VAMP (Thomason, Kingston and Kavraki 2024) knows boxes and capsules, so a scene is posed to both with capsules for its
cylinders and without floor or margin. A problem is the robot's home and one goal, free in both. The two take turns at
it, called from Python, each with its own settings for the Panda; medians by processor time in one thread. Lengths are
those of simplified paths in joint space. Where VAMP is not installed (it has no wheel, and its build downloads
sources), ours runs alone.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from claims import state
from planners import SETTINGS

from plancurate import native
from plancurate.robots import Robot, Scene, load_world
from plancurate.robots.scene import SceneShape, native_scene
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.sources.ompl import run_planner
from plancurate.tasks.candidates.targets import sample_targets

try:
    from peers.vamp_panda import Vamp
except ModuleNotFoundError as missing:
    if missing.name != "vamp":
        raise
    Vamp = None

CHECKED = 0.001  # rad between the states at which paths are looked at afterwards


@dataclass(frozen=True)
class Trial:
    """One problem: seconds of processor time, and the simplified path (v, n), rad; None without a solution."""

    plan_s: float
    simplify_s: float
    path: FloatArray | None


Planner = Callable[[FloatArray, FloatArray, int], Trial]  # from start (n,) to goal (n,), with a seed


def main() -> None:
    """Compare in each scene."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", nargs="+", default=("table", "shelf", "passage"))
    parser.add_argument("--targets", type=int, default=20)
    parser.add_argument("--runs", type=int, default=10, help="to each target, its goals in turn")
    parser.add_argument(
        "--resolution", type=float, default=SETTINGS.plan.resolution, help="of ours, rad; VAMP's is 1/32"
    )
    asked = parser.parse_args()
    for name in asked.scenes:
        compare(name, asked.targets, asked.runs, asked.resolution)


def compare(scene_name: str, targets: int, runs: int, resolution: float) -> None:
    """Print a line for each that plans in a scene, and state the medians."""
    robot, scene = load_world("panda", scene_name)
    drawn = sample_targets(robot, scene, SETTINGS.targets, 0, targets)
    scene = posed_to_both(scene)
    goals = [target.goals[native.is_free(robot.native, scene.native, target.goals)] for target in drawn]
    planners: dict[str, Planner] = {"ours": partial(by_native, robot, scene, resolution)}
    if Vamp is not None:
        vamp = Vamp(scene.shapes)
        goals = [found[[vamp.is_free(q) for q in found]] for found in goals]
        planners["VAMP"] = partial(by_vamp, vamp)
    goals = [found for found in goals if len(found)]
    trials: dict[str, list[Trial]] = {name: [] for name in planners}
    for seed in range(runs):
        for found in goals:
            for name, planner in planners.items():
                trials[name].append(planner(robot.home, found[seed % len(found)], seed))
    print(f"panda, scene {scene_name}, {len(goals)} targets of {targets}, {runs} runs to each:")
    medians = {name: report(name, robot, scene, made) for name, made in trials.items()}
    if "VAMP" in medians:
        for stage, ours, theirs in zip(("plan", "simplify"), *medians.values(), strict=True):
            what = f"{stage} of RRTConnect for the Panda, scene {scene_name}"
            state(what, "us", ours, "VAMP", theirs, wished=None, less_is_better=True)


def posed_to_both(scene: Scene) -> Scene:
    """The scene without floor and margin, capsules for its cylinders."""
    shapes = tuple(
        SceneShape(entry.name, replace(entry.shape, kind="capsule"))
        if entry.shape.kind == "cylinder"
        else entry
        for entry in scene.shapes
    )
    return replace(scene, shapes=shapes, ground=None, margin=0.0, native=native_scene(shapes, None, 0.0))


def by_native(
    robot: Robot, scene: Scene, resolution: float, start: FloatArray, goal: FloatArray, seed: int
) -> Trial:
    """Plan and simplify by ours."""
    settings = SETTINGS.plan.model_copy(update={"resolution": resolution})
    planned, plan_s = timed(
        lambda: run_planner("RRTConnect", robot, scene, start, goal[None], settings, seed)
    )
    if planned.status != "exact":
        return Trial(plan_s, 0.0, None)
    path, simplify_s = timed(
        lambda: native.simplify(robot.native, scene.native, planned.path, seed=seed, resolution=resolution)
    )
    return Trial(plan_s, simplify_s, path)


def by_vamp(vamp: Vamp, start: FloatArray, goal: FloatArray, _seed: int) -> Trial:
    """Plan and simplify by VAMP, whose draws go on from one run to the next."""
    ends = start.astype(np.float32), goal.astype(np.float32)
    planned, plan_s = timed(lambda: vamp.plan(*ends))
    if not planned.solved:
        return Trial(plan_s, 0.0, None)
    simplified, simplify_s = timed(lambda: vamp.simplify(planned.path))
    return Trial(plan_s, simplify_s, simplified.path.numpy().astype(np.float64))


def timed(call: Callable[[], Any]) -> tuple[Any, float]:
    """What a call gives, and its processor time, s."""
    start = time.process_time()
    given = call()
    return given, time.process_time() - start


def report(name: str, robot: Robot, scene: Scene, trials: list[Trial]) -> tuple[float, float]:
    """Print what a planner did; its medians to plan and to simplify, us."""
    solved = [trial for trial in trials if trial.path is not None]
    plan_us, slow_us, simplify_us = (
        1e6 * float(value)
        for value in (
            *np.percentile([trial.plan_s for trial in solved], [50, 95]),
            np.median([trial.simplify_s for trial in solved]),
        )
    )
    paths = [trial.path for trial in solved if trial.path is not None]
    lengths = [np.linalg.norm(np.diff(path, axis=0), axis=1).sum() for path in paths]
    free = [
        native.edge_is_free(robot.native, scene.native, path[:-1], path[1:], CHECKED).all() for path in paths
    ]
    print(
        f"  {name:5s} {len(solved)}/{len(trials)} solved, plan {plan_us:.0f} us (95 %: {slow_us:.0f}), simplify "
        f"{simplify_us:.0f} us, length {np.median(lengths):.2f}, {100 * np.mean(free):.1f} % of paths free by ours",
        flush=True,
    )
    return plan_us, simplify_us


if __name__ == "__main__":
    main()
