"""What a policy must see of obstacles to reach among ones that it was never shown: each term alone, and together.

    python experiments/clutter.py [--training 200] [--tests 40] [--json rates.json]

Draws scenes of the family `clutter`, plans in each with RRTConnect (the shortest of a few runs), trains one BC_MLP on
all of them with every set of terms, and rolls out in scenes that none was trained in: in all, and to the hard targets,
whose straight joint line is not free. The goal of a target is its inverse-kinematics solution nearest to home.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import cache
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import torch

from plancurate.errors import PlancurateError
from plancurate.robots import Robot, Scene, load_robot, load_scene
from plancurate.tasks.candidates.consistent_goals import draw_targets
from plancurate.tasks.candidates.goals import nearest_goal
from plancurate.tasks.candidates.plan import plan_candidate
from plancurate.tasks.candidates.polylines import path_length
from plancurate.tasks.candidates.scene_report import is_hard
from plancurate.tasks.candidates.settings import GenerateSettings
from plancurate.tasks.candidates.targets import Target
from plancurate.tasks.learning.demonstrations import Demonstrations, demonstrations
from plancurate.tasks.learning.join import join_demonstrations
from plancurate.tasks.learning.policies import TrainedPolicy
from plancurate.tasks.learning.rollouts import roll_out
from plancurate.tasks.learning.settings import TrainSettings
from plancurate.tasks.learning.test_targets import unseen_tests
from plancurate.tasks.learning.train import train
from plancurate.tasks.learning.training_goals import FloatArray
from plancurate.tasks.study.config import StudyConfig, load_config
from plancurate.tasks.study.statistics import wilson_interval

CONFIG = Path(__file__).with_name("clutter.yaml")
TRAINING_SCENES, TEST_SCENES = 10_000, 20_000  # the first of each
DETOURS = 3.0  # how much more often a step of a hard target is drawn: most targets need no detour
BASE = ("target_offset", "joint_positions", "goal_offset")
CLEARANCES = ("clearances_around", "clearances_toward_goal")
ROWS: dict[str, tuple[str, ...]] = {
    "no scene term": (),
    "clearances around and toward the goal": CLEARANCES,
    "clearances around": CLEARANCES[:1],
    "clearances toward the goal": CLEARANCES[1:],
    "nearest obstacle": ("nearest_obstacle",),
    "key collisions": ("key_collisions",),
    "scene parameters": ("scene_parameters",),
}


@dataclass(frozen=True, eq=False)
class Problems:
    """Targets in one scene; `paths` are the shortest planned ones (w, n), rad, None where no run succeeded."""

    scene: int
    targets: list[Target]
    paths: list[FloatArray | None]
    hard: list[bool]


@dataclass(frozen=True)
class Rate:
    """Successes of n tests, and of the hard ones among them."""

    row: str
    n: int
    successes: int
    hard_n: int
    hard_successes: int


def main() -> None:
    """Plan, train, roll out, and print a line for each row."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--training", type=int, default=200, help="scenes to train in")
    parser.add_argument("--tests", type=int, default=40, help="scenes to test in")
    parser.add_argument("--json", type=Path)
    asked = parser.parse_args()
    if asked.training > TEST_SCENES - TRAINING_SCENES:
        parser.error(f"--training: at most {TEST_SCENES - TRAINING_SCENES}, so that no test scene trains")
    training_seeds = range(TRAINING_SCENES, TRAINING_SCENES + asked.training)
    test_seeds = range(TEST_SCENES, TEST_SCENES + asked.tests)
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as processes:
        training, tests = (
            list(processes.map(planned_in, seeds, chunksize=5)) for seeds in (training_seeds, test_seeds)
        )
        rates = references(tests)
        print(*map(line, rates), sep="\n", flush=True)
        for rate in processes.map(measure, ROWS, [training] * len(ROWS), [tests] * len(ROWS)):
            print(line(rate), flush=True)
            rates.append(rate)
    if asked.json:
        asked.json.write_text(json.dumps([asdict(rate) for rate in rates], indent=1) + "\n", encoding="utf-8")


def line(rate: Rate) -> str:
    """A rate for a person."""
    parts = [share(rate.successes, rate.n), "hard", share(rate.hard_successes, rate.hard_n)]
    return f"{rate.row:40} {' '.join(parts)}"


def share(successes: int, n: int) -> str:
    """A rate in percent with its interval."""
    if not n:
        return "none"
    interval = wilson_interval(successes, n)
    return f"{100 * successes / n:5.1f} ({100 * interval.low:.1f} to {100 * interval.high:.1f}, n {n})"


@cache
def configuration() -> StudyConfig:
    """What clutter.yaml says."""
    torch.set_num_threads(1)
    return load_config("smoke", CONFIG, {})


@cache
def world(seed: int) -> tuple[Robot, Scene]:
    """The robot, and the member of the family with this seed."""
    robot = load_robot(configuration().robot)
    return robot, load_scene(f"clutter:{seed}", robot)


def candidate_settings() -> GenerateSettings:
    """How targets are drawn and planned to."""
    return configuration().pool_settings(configuration().pool_labels[0])


def planned_in(seed: int) -> Problems:
    """Draw the targets of a scene, other ones in each, and plan to them."""
    config, settings = configuration(), candidate_settings()
    robot, scene = world(seed)
    count = config.n_targets if seed < TEST_SCENES else config.unseen
    targets = draw_targets(robot, scene, settings, seed * count, count)
    paths = [shortest(robot, scene, target, settings) for target in targets]
    hard = [is_hard(robot, scene, target.goals, settings) for target in targets]
    return Problems(seed, targets, paths, hard)


def shortest(robot: Robot, scene: Scene, target: Target, settings: GenerateSettings) -> FloatArray | None:
    """The shortest path (w, n), rad, of the runs that reach a target."""
    planner = configuration().planners[0]
    runs = [plan_candidate(robot, scene, target, planner, run, settings) for run in range(settings.plan.runs)]
    paths = [run.path for run in runs if run.status == "exact"]
    return min(paths, key=path_length, default=None)


def references(tests: list[Problems]) -> list[Rate]:
    """What a planner reaches, and the straight joint line."""
    hard = [one for part in tests for one in part.hard]
    planned = [path is not None for part in tests for path in part.paths]
    return [counted("planner", planned, hard), counted("straight line", [not one for one in hard], hard)]


def measure(row: str, training: list[Problems], tests: list[Problems]) -> Rate:
    """Train with the terms of a row and roll out in all test scenes."""
    began = time.perf_counter()
    terms = (*BASE, *ROWS[row])
    settings = configuration().training.model_copy(update={"observation": terms})
    shown = [shown_in(part, settings) for part in training if any(path is not None for path in part.paths)]
    policy = train("BC_MLP", [join_demonstrations(shown)], [0], settings)[0]
    success = [one for part in tests for one in reached(policy, part)]
    print(f"  {row}: {time.perf_counter() - began:.0f} s", file=sys.stderr, flush=True)
    return counted(row, success, [one for part in tests for one in part.hard])


def shown_in(part: Problems, settings: TrainSettings) -> Demonstrations:
    """Demonstrations of the paths planned in one scene."""
    robot, scene = world(part.scene)
    known = [(k, path) for k, path in enumerate(part.paths) if path is not None]
    return demonstrations(
        robot,
        scene,
        [path for _, path in known],
        np.stack([part.targets[k].position for k, _ in known]),
        settings,
        weights=np.array([DETOURS if part.hard[k] else 1.0 for k, _ in known]),
    )


def reached(policy: TrainedPolicy, part: Problems) -> list[bool]:
    """Which targets of a scene a policy reaches."""
    robot, scene = world(part.scene)
    goals = np.stack([nearest_goal(robot, target.goals) for target in part.targets])[None]
    settings, dt = configuration().evaluation, candidate_settings().timing.dt
    trials = roll_out([policy], robot, scene, unseen_tests(part.targets), settings, dt, goals)[0]
    success: list[bool] = trials["success"].to_pylist()
    return success


def counted(row: str, success: Iterable[bool], hard: Iterable[bool]) -> Rate:
    """Counts of a row."""
    reached, blocked = np.array(list(success)), np.array(list(hard))
    return Rate(row, len(reached), int(reached.sum()), int(blocked.sum()), int((reached & blocked).sum()))


if __name__ == "__main__":
    try:
        main()
    except PlancurateError as error:
        sys.exit(f"{error}")
