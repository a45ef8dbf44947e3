"""Networks trained a second: many in one stack against one after another.

    python benchmarks/train.py [--networks 24] [--steps 200]

Every network of a stack takes the same batched matrix products, so that a step of small networks costs fewer calls.
Trains the same networks both ways on the same demonstrations, in one thread as the flow does, and compares their
weights: a network does not depend on its neighbours.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
import torch
from claims import state

from plancurate.robots import load_robot, load_scene
from plancurate.tasks.learning.demonstrations import Demonstrations, demonstrations
from plancurate.tasks.learning.policies import TrainedPolicy, policy_names
from plancurate.tasks.learning.settings import TrainSettings
from plancurate.tasks.learning.train import train

WISHED = 5.0  # times as fast; see docs/performance.md for what it takes


def main() -> None:
    """Train each policy both ways and print seconds and ratios."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--networks", type=int, default=24)
    parser.add_argument("--steps", type=int, default=200)
    asked = parser.parse_args()
    torch.set_num_threads(1)
    data, settings = lines_from_home(), TrainSettings(steps=asked.steps)
    print(f"{asked.networks} networks, {asked.steps} gradient steps each, one thread")
    timed(policy_names()[0], data, [0], settings)  # what torch does at its first steps alone
    for name in policy_names():
        stacked_s, stacked = timed(name, data, list(range(asked.networks)), settings)
        single = [timed(name, data, [seed], settings) for seed in range(asked.networks)]
        single_s = sum(seconds for seconds, _ in single)
        same = all(equal(one[0], many) for (_, one), many in zip(single, stacked, strict=True))
        print(
            f"  {name:15s} stacked {stacked_s:5.1f} s, one by one {single_s:5.1f} s: {single_s / stacked_s:4.1f}x, "
            f"weights {'equal bit for bit' if same else 'differ'}"
        )
        what = f"training of {asked.networks} networks, {name}"
        state(what, "s", stacked_s, "one by one", single_s, wished=WISHED, less_is_better=True)


def lines_from_home(count: int = 100, waypoints: int = 60) -> Demonstrations:
    """Straight joint-space motions of the H2017 from home."""
    robot = load_robot("h2017")
    ends = robot.home + np.random.default_rng(0).normal(0, 0.3, (count, robot.dof))
    paths = [robot.home + np.linspace(0, 1, waypoints)[:, None] * (end - robot.home) for end in ends]
    return demonstrations(robot, load_scene("free"), paths, np.zeros((count, 3)))


def timed(
    name: str, data: Demonstrations, seeds: list[int], settings: TrainSettings
) -> tuple[float, list[TrainedPolicy]]:
    """Processor time, s, and networks of one call."""
    began = time.process_time()
    trained = train(name, [data] * len(seeds), seeds, settings)
    return time.process_time() - began, trained


def equal(one: TrainedPolicy, other: TrainedPolicy) -> bool:
    """Whether two networks have the same weights, bit for bit."""
    return all(torch.equal(one.weights[name], other.weights[name]) for name in one.weights)


if __name__ == "__main__":
    main()
