"""What a policy's look at the scene costs: microseconds of each observation term, for one state and for many.

    python benchmarks/observations.py [--scene clutter:7] [--states 4096]

States around home, in one thread, by processor time; the best of several rounds. A rollout of a few tests pays nearly
the price of one state, demonstrations and rollouts of many networks pay that of many.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from plancurate.robots import Robot, Scene, load_world
from plancurate.tasks.learning.observations import State, find_term, observe, state_at, term_names

ROUNDS = 7
SPREAD_RAD = 0.5


def main() -> None:
    """Print a line for each term."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robot", default="h2017")
    parser.add_argument("--scene", default="clutter:7")
    parser.add_argument("--states", type=int, default=4096)
    asked = parser.parse_args()
    robot, scene = load_world(asked.robot, asked.scene)
    one, many = states(robot, scene, 1), states(robot, scene, asked.states)
    print(f"microseconds an observation, robot {robot.name}, scene {scene.name}")
    print(f"  {'term':24s} numbers  one state  of {asked.states} at once")
    for name in term_names():
        size = find_term(name).size(robot)
        print(f"  {name:24s} {size:7d} {cost_us(name, one):10.1f} {cost_us(name, many):10.3f}", flush=True)


def states(robot: Robot, scene: Scene, count: int) -> State:
    """States around home, each with a goal around home."""
    rng = np.random.default_rng(0)
    q, goal = (robot.home + rng.uniform(-SPREAD_RAD, SPREAD_RAD, (count, robot.dof)) for _ in range(2))
    return state_at(robot, scene, q, np.zeros((count, 3)), previous_q=q, goal=goal)


def cost_us(name: str, state: State) -> float:
    """Microseconds a state; what a term keeps of a scene is there from a first look."""
    observe([name], state)
    calls = max(1, 256 // len(state.q))
    rounds = []
    for _ in range(ROUNDS):
        start = time.process_time()
        for _ in range(calls):
            observe([name], state)
        rounds.append(time.process_time() - start)
    return 1e6 * min(rounds) / calls / len(state.q)


if __name__ == "__main__":
    main()
