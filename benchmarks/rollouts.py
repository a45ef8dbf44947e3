"""Policy steps a second of rollouts in one thread: look, act, check limits and collisions, move.

    python benchmarks/rollouts.py [--scene table] [--networks 8] [--tests 512] [--repeats 5]

Networks of each policy, trained a little on straight motions, are rolled out on random targets as `evaluate` does; the
median by processor time. A step of one network in one test counts as one. Claimed for BC_MLP: 200 000.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections import deque

import numpy as np
import torch
from claims import state
from train import lines_from_home

from plancurate.robots import load_world
from plancurate.tasks.learning.policies import TrainedPolicy, policy_names
from plancurate.tasks.learning.rollouts import moves
from plancurate.tasks.learning.settings import EvaluateSettings, TrainSettings
from plancurate.tasks.learning.train import train

CLAIMED = {"BC_MLP": 200_000.0}
TRAINED, MOVES, DT = 300, 40, 0.05  # gradient steps; steps of a rollout; s


def main() -> None:
    """Print a line for each policy."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scene", default="table")
    parser.add_argument("--networks", type=int, default=8)
    parser.add_argument("--tests", type=int, default=512)
    parser.add_argument("--repeats", type=int, default=5)
    asked = parser.parse_args()
    torch.set_num_threads(1)
    data = lines_from_home()
    for name in policy_names():
        trained = train(
            name, [data] * asked.networks, list(range(asked.networks)), TrainSettings(steps=TRAINED)
        )
        rate = statistics.median(
            steps_a_second(trained, asked.scene, asked.tests) for _ in range(asked.repeats)
        )
        print(f"  {name:15s} {rate:10,.0f} policy steps a second", flush=True)
        if name in CLAIMED:
            state(f"policy steps of {name}", "1/s", rate, "limit", CLAIMED[name])


def steps_a_second(policies: list[TrainedPolicy], scene_name: str, tests: int) -> float:
    """Steps a second of processor time."""
    robot, scene = load_world("h2017", scene_name)
    home = np.array([0.7, 0.0, 0.8])  # m: about where the tool can get
    positions = home + np.random.default_rng(0).uniform(-0.2, 0.2, (tests, 3))
    start = time.process_time()
    deque(moves(policies, robot, scene, positions, EvaluateSettings(max_steps=MOVES), DT), maxlen=0)
    return len(policies) * tests * MOVES / (time.process_time() - start)


if __name__ == "__main__":
    main()
