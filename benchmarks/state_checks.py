"""State checks a second and solves a second of `native`, beside its peers in the same run.

    pip install pin ompl==2.0.1
    python benchmarks/state_checks.py [--scene table] [--targets 3] [--fewest-calls]

PyBullet, and Pinocchio with Coal, check the same states of the same robot in the same scene. OMPL's Python
wheel (2.0.1 binds 10 of the 23 planners) plans the same problems with the same parameters, asking PyBullet
about each state as public interfaces between the two do (joint by joint, pair by pair), or, which is much
faster, in the fewest calls that PyBullet allows. One thread each, by processor time. Claimed: 200 times the
wheel with PyBullet as usually asked, 20 times Coal.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
import time
from concurrent.futures import TimeoutError
from dataclasses import dataclass

import numpy as np
from claims import state
from pebble import ProcessExpired, ProcessPool

from plancurate import native
from plancurate.robots import Robot, Scene, load_robot, load_scene
from plancurate.tasks.candidates.settings import GenerateSettings, PlanSettings
from plancurate.tasks.candidates.sources.ompl import run_planner
from plancurate.tasks.candidates.targets import Target, sample_targets

try:
    from peers.checks import BulletChecks, BulletPairChecks, CoalChecks
    from peers.wheel import Solve, wheel_planners, wheel_solve
except ModuleNotFoundError as missing:
    sys.exit(f"a peer of this comparison is missing ({missing.name}): pip install pin ompl==2.0.1")

PEERS = {
    "Pinocchio+Coal": CoalChecks,
    "PyBullet, as usual": BulletPairChecks,
    "PyBullet, fewest calls": BulletChecks,
}
OVER_WHEEL, OVER_COAL = 200, 20  # what is claimed
STATES, PEER_STATES = 400_000, 10_000
LIMIT_S, OPTIMIZING_S = 15.0, 2.0  # of a run of the wheel
NATIVE_RUNS = 10
SETTINGS = GenerateSettings(plan=PlanSettings(simplification="off"))


def main() -> None:
    """Run both comparisons and say whether the claims hold."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robot", default="h2017")
    parser.add_argument("--scene", default="table")
    parser.add_argument("--targets", type=int, default=3, help="problems for each planner")
    parser.add_argument(
        "--fewest-calls", action="store_true", help="the wheel asks PyBullet as fast as can be"
    )
    arguments = parser.parse_args()
    robot, scene = load_robot(arguments.robot), load_scene(arguments.scene)
    over_coal = compare_checks(robot, scene)
    targets = sample_targets(robot, scene, SETTINGS.targets, 0, arguments.targets)
    wheel = Wheel((arguments.robot, arguments.scene), not arguments.fewest_calls)
    checks, solves = compare_planning(robot, scene, targets, wheel)
    print()
    claim("state checks, over Pinocchio+Coal", over_coal, OVER_COAL)
    claim("state checks while planning, over the wheel with PyBullet", checks, OVER_WHEEL)
    claim("solves, over the wheel with PyBullet", solves, OVER_WHEEL)


def claim(what: str, ratio: float, least: float) -> None:
    """Print a ratio and whether it is what is claimed."""
    print(f"{what}: {ratio:.0f}x, {'at least' if ratio >= least else 'NOT the claimed'} {least}x")
    state(what, "times", ratio, "its own", 1.0, wished=least)


def compare_checks(robot: Robot, scene: Scene) -> float:
    """Check random states of the whole joint space; return native's advantage over Coal."""
    q = np.random.default_rng(0).uniform(robot.lower, robot.upper, (STATES, robot.dof))
    start = time.process_time()
    free = native.is_free(robot.native, scene.native, q)
    own = len(q) / (time.process_time() - start)
    print(f"state checks a second, scene {scene.name}, {free.mean():.0%} of the states free")
    print(f"  native {own:,.0f}")
    over = {}
    for name, peer in PEERS.items():
        check, states = peer(robot, scene).is_free, q[:PEER_STATES]
        states = states if peer is CoalChecks else states.tolist()
        start = time.process_time()
        answers = np.array([check(state) for state in states])
        rate = len(states) / (time.process_time() - start)
        over[name] = own / rate
        wrong = int((free[:PEER_STATES] & ~answers).sum())
        print(f"  {name} {rate:,.0f}: native {over[name]:.0f}x, {wrong} free for native alone", flush=True)
    return over["Pinocchio+Coal"]


@dataclass(frozen=True)
class Wheel:
    """OMPL's wheel in a process of its own: some of its planners hang or crash with Python callbacks."""

    names: tuple[str, str]
    pairwise: bool

    def run(self, info: native.PlannerInfo, targets: list[Target]) -> list[Solve]:
        """Plan to each target; none if the process crashed or hung."""
        limit = OPTIMIZING_S if info.optimizing else LIMIT_S
        with ProcessPool(max_workers=1, context=multiprocessing.get_context("spawn")) as pool:
            runs = []
            for target in targets:
                problem = (
                    self.names,
                    info.name,
                    info.params,
                    target.goals,
                    2 * SETTINGS.plan.resolution,
                    limit,
                )
                job = pool.schedule(wheel_solve, args=(*problem, self.pairwise), timeout=limit + 30)
                try:
                    runs.append(job.result())
                except (ProcessExpired, TimeoutError):
                    return []
        return runs


def compare_planning(robot: Robot, scene: Scene, targets: list[Target], wheel: Wheel) -> tuple[float, float]:
    """Plan with all that the wheel binds; return native's advantage in state checks and in solves.

    Optimising planners spend what they are given, so they count for state checks alone.
    """
    known = {info.name: info for info in native.planners()}
    checks, solves = [], []
    print(f"\nplanning, {len(targets)} problems: checks a second, solves a second (native, wheel, ratio)")
    for planner in [name for name in wheel_planners() if name in known]:
        theirs = wheel.run(known[planner], targets)
        if not theirs:
            print(f"  {planner:10s} the wheel hangs or crashes", flush=True)
            continue
        mine, peer = rates(native_runs(robot, scene, targets, planner)), rates(theirs)
        checks.append(mine[0] / peer[0])
        line = f"  {planner:10s} {mine[0]:12,.0f} {peer[0]:9,.0f} {checks[-1]:6.0f}x"
        if not known[planner].optimizing:
            solves.append(mine[1] / peer[1])
            line += f" {mine[1]:10,.0f} {peer[1]:9.2f} {solves[-1]:6.0f}x"
        print(line, flush=True)
    return geometric_mean(checks), geometric_mean(solves)


def native_runs(robot: Robot, scene: Scene, targets: list[Target], planner: str) -> list[Solve]:
    """Plan to each target's goals, as the wheel does, several times over, since one run is too short to time."""
    runs = []
    for run in range(NATIVE_RUNS):
        for target in targets:
            start = time.process_time()
            result = run_planner(planner, robot, scene, robot.home, target.goals, SETTINGS.plan, run)
            runs.append(Solve(result.status == "exact", result.state_checks, time.process_time() - start))
    return runs


def rates(runs: list[Solve]) -> tuple[float, float]:
    """Return state checks and solves a second over several runs."""
    seconds = sum(run.seconds for run in runs)
    return sum(run.state_checks for run in runs) / seconds, sum(run.solved for run in runs) / seconds


def geometric_mean(ratios: list[float]) -> float:
    """Average ratios."""
    return float(np.exp(np.mean(np.log(ratios))))


if __name__ == "__main__":
    main()
