"""What it takes to reach targets among obstacles: each ingredient left out in turn, on development targets alone.

    python experiments/hard_scenes.py [--home data/hard_scenes] [--seeds 2] [--json rates.json] [--pictures FOLDER]

Plans in four scenes with the ingredients (orientation tolerance, clearance while planning, goals that continue each
other's) and without each, trains BC_MLP on selections with and without arc steps, the goal term and corrections, and
rolls out on unseen targets of the same seed: in all, and on the hard ones, whose straight joint line is not free.
clearance_labels.py has what corrections are compared with.
A picture shows a rollout that fails without an ingredient beside the one that succeeds with it.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import warnings
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field
from functools import cache, partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import torch
from clearance_labels import trained_hinged, trained_nearby

from plancurate.errors import PlancurateError
from plancurate.robots.shapes import BoolArray, FloatArray
from plancurate.tasks.candidates.targets import sample_targets
from plancurate.tasks.lake.home import Home
from plancurate.tasks.learning.failures import COLLIDED
from plancurate.tasks.learning.policies import TrainedPolicy
from plancurate.tasks.learning.reach import goal_solutions
from plancurate.tasks.learning.rollouts import roll_out
from plancurate.tasks.learning.test_targets import TargetsUnderTest, reachable_tests, unseen_tests
from plancurate.tasks.motion.rollout import goals_of
from plancurate.tasks.pictures.files import write_shots
from plancurate.tasks.pictures.rollout_shots import rollout_run
from plancurate.tasks.pictures.shot import Shot
from plancurate.tasks.study.config import load_config
from plancurate.tasks.study.context import PoolContext, StudyContext, open_study
from plancurate.tasks.study.corrections import make_corrections, missing_corrections
from plancurate.tasks.study.networks import is_trained, load_network, train_networks, wanted_networks
from plancurate.tasks.study.selections import WantedSelection, study_selections

CONFIG = Path(__file__).with_name("hard_scenes.yaml")
OURS, EVERYTHING = "ModeConsistent", "everything"
NO_GOAL = {"observation": ["target_offset", "joint_positions"]}
DRAWS = 2000  # of the tests, for an interval
SIZE = (360, 300)  # of a picture's halves, pixels


@dataclass(frozen=True)
class Row:
    """A study in one scene that differs in one thing, or in two, from the one with everything."""

    selector: str = OURS
    pool: str = "all"
    training: dict[str, Any] = field(default_factory=dict)
    targets: int | None = None
    rounds: int = 0
    """Of corrections."""
    drawn_goals: bool = False
    """Whether the goal of a test is the nearest of drawn solutions, instead of continued from its neighbours'."""
    otherwise: Callable[[StudyContext, PoolContext, WantedSelection], list[TrainedPolicy]] | None = None
    """What trains the networks, if not the study's own training; the home keeps nothing of it."""


ROWS = {
    EVERYTHING: Row(),
    "ways, no target left out": Row(f"{OURS}(leave_out=0.0)"),
    "global ranking": Row("RuleBased_General"),
    "KMeans_Hybrid": Row("KMeans_Hybrid"),
    "random": Row("Random"),
    "all candidates": Row("General"),
    "no orientation tolerance": Row(pool="exact"),
    "no clearance": Row(pool="close"),
    "drawn goals in planning": Row(pool="drawn"),
    "drawn goals at tests": Row(drawn_goals=True),
    "drawn goals in both": Row(pool="drawn", drawn_goals=True),
    "time steps": Row(training={"demonstration_steps": "time"}),
    "no goal term": Row(training=NO_GOAL),
    "no goal term, global ranking": Row("RuleBased_General", training=NO_GOAL),
    "no goal term, KMeans_Hybrid": Row("KMeans_Hybrid", training=NO_GOAL),
    "no goal term, random": Row("Random", training=NO_GOAL),
    "128 targets": Row(targets=128),
    "one round of corrections": Row(rounds=1),
    "two rounds of corrections": Row(rounds=2),
    "paths relaxed": Row(pool="relaxed"),
    "paths relaxed, global ranking": Row("RuleBased_General", pool="relaxed"),
    "paths relaxed, KMeans_Hybrid": Row("KMeans_Hybrid", pool="relaxed"),
    "paths relaxed, random": Row("Random", pool="relaxed"),
    "states near demonstrations": Row(otherwise=partial(trained_nearby, push=False)),
    "labels pushed out of collision": Row(otherwise=partial(trained_nearby, push=True)),
    "hinge on clearance": Row(otherwise=trained_hinged),
}


@dataclass(frozen=True)
class Rate:
    """Shares of `n` unseen targets, means over training seeds, in percent, with 95 % intervals over drawn targets."""

    scene: str
    row: str
    n: int
    success: tuple[float, float, float]
    settled: tuple[float, float, float]
    hard_n: int
    hard_success: tuple[float, float, float]
    """On those whose straight line is not free."""
    failures: dict[str, int]


def main() -> None:
    """Measure every row in every scene."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--home", type=Path, default=Path("data/hard_scenes"))
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--scenes", nargs="*", default=load_config("smoke", CONFIG, {}).scenes)
    parser.add_argument("--rows", nargs="*", default=list(ROWS), help="only these rows")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--pictures", type=Path, help="folder for a picture of each row in each scene")
    asked = parser.parse_args()
    command = [sys.executable, "-m", "plancurate.flows.cli.app", "generate"]
    options = ["--config", CONFIG, "--home", asked.home, "--scenes", *asked.scenes]
    subprocess.run([*command, *options], check=True)
    wanted = [(scene, row, asked.seeds, asked.home) for scene in asked.scenes for row in asked.rows]
    rates = []
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as processes:
        for rate in processes.map(measure, wanted):
            print(line(rate), flush=True)
            rates.append(rate)
    if asked.json:
        asked.json.write_text(json.dumps([asdict(rate) for rate in rates], indent=1) + "\n", encoding="utf-8")
    if asked.pictures:
        asked.pictures.mkdir(parents=True, exist_ok=True)
        for scene, row, _, home in wanted:
            if row != EVERYTHING:
                draw(scene, row, home, asked.pictures)


def line(rate: Rate) -> str:
    """A rate for a person."""
    shares = "  ".join(
        f"{name} {mean:5.1f} ({low:.0f} to {high:.0f})"
        for name, (mean, low, high) in (
            ("success", rate.success),
            ("settled", rate.settled),
            ("hard", rate.hard_success),
        )
    )
    return f"{rate.scene:9} {rate.row:30} {shares}  n {rate.n} hard {rate.hard_n}  {rate.failures}"


def measure(wanted: tuple[str, str, int, Path]) -> Rate:
    """Train on one selection in one scene and roll out."""
    scene, row, seeds, home = wanted
    warnings.simplefilter("ignore")
    torch.set_num_threads(1)
    study, pool = opened(scene, row, home, seeds)
    tests = tests_of(scene, home)
    tables = rolled_out(study, pool, row, networks_of(study, pool, row), tests)
    success, settled = (
        np.array([table[name].to_pylist() for table in tables]) for name in ("success", "settled")
    )
    assert tests.hard is not None
    failures = Counter(reason for table in tables for reason in table["failure"].to_pylist() if reason)
    return Rate(
        scene, row, len(tests), interval(success), interval(settled), int(tests.hard.sum()),
        interval(success[:, tests.hard]), dict(sorted(failures.items())),
    )  # fmt: skip


def opened(scene: str, row: str, home: Path, seeds: int) -> tuple[StudyContext, PoolContext]:
    """The study of one row in one scene, and its pool."""
    wanted = ROWS[row]
    options = {
        "scenes": [scene],
        "seeds": list(range(seeds)),
        "training": wanted.training,
        "corrections": {"rounds": wanted.rounds},
    }
    if wanted.targets is not None:
        options["n_targets"] = wanted.targets
    study = open_study(load_config("smoke", CONFIG, options), Home.resolve(home))
    return study, next(pool for pool in study.pools if pool.label == wanted.pool)


def networks_of(study: StudyContext, pool: PoolContext, row: str) -> list[TrainedPolicy]:
    """The networks of a row after their last round of corrections, one a seed; trains what the home lacks."""
    selections = [
        one
        for one in study_selections(study)
        if (one.pool, one.choice.label) == (pool.pool, ROWS[row].selector)
    ]
    if train_otherwise := ROWS[row].otherwise:
        return train_otherwise(study, pool, selections[0])
    networks = wanted_networks(study, selections)
    for number in range(ROWS[row].rounds + 1):
        missing = [n for n in networks if n.round == number and not is_trained(study, n)]
        if number:
            for network in missing_corrections(study, missing):
                make_corrections(study, network)
        if missing:
            train_networks(study, missing)
    return [load_network(study, network) for network in networks if network.round == ROWS[row].rounds]


@cache
def tests_of(scene: str, home: Path) -> TargetsUnderTest:
    """Unseen targets of a scene, the same for all rows: drawn with the orientation tolerance."""
    study, pool = opened(scene, EVERYTHING, home, 1)
    seed = study.config.evaluation.seed
    settings = pool.settings.targets.model_copy(update={"seed": seed})
    tests = unseen_tests(sample_targets(pool.robot, pool.scene, settings, 0, study.config.unseen))
    return reachable_tests(tests, pool.robot, [pool.scene] * len(tests), pool.settings, seed)


def rolled_out(
    study: StudyContext,
    pool: PoolContext,
    row: str,
    networks: Sequence[TrainedPolicy],
    tests: TargetsUnderTest,
) -> list[pa.Table]:
    """A table of trials for each network."""
    shown = [
        one
        for one in (goals_shown(study, pool, row, policy, tests) for policy in networks)
        if one is not None
    ]
    goals = np.stack(shown) if shown else None
    return roll_out(
        networks, pool.robot, pool.scene, tests, study.config.evaluation, pool.settings.timing.dt, goals
    )


def goals_shown(
    study: StudyContext, pool: PoolContext, row: str, policy: TrainedPolicy, tests: TargetsUnderTest
) -> FloatArray | None:
    """Goal configurations (tests, n) that a network is shown; None where it observes none."""
    seed, settings = study.config.evaluation.seed, pool.settings.targets
    if policy.goals is None or not ROWS[row].drawn_goals:
        return goals_of(policy, pool.robot, pool.scene, tests.position, settings, seed)
    goals = policy.goals.at(tests.position)
    for i, position in enumerate(tests.position):
        drawn = goal_solutions(pool.robot, pool.scene, position, settings, (seed, i))
        if len(drawn):
            goals[i] = drawn[np.linalg.norm(drawn - goals[i], axis=1).argmin()]
    return goals


def interval(outcomes: BoolArray) -> tuple[float, float, float]:
    """Mean of outcomes (networks, tests) in percent, and its 95 % interval over tests drawn again."""
    shares = 100 * outcomes.mean(axis=0)
    drawn = np.random.default_rng(0).integers(len(shares), size=(DRAWS, len(shares)))
    low, high = np.percentile(shares[drawn].mean(axis=1), [2.5, 97.5])
    return round(float(shares.mean()), 1), round(float(low), 1), round(float(high), 1)


def draw(scene: str, row: str, home: Path, folder: Path) -> None:
    """Picture a test at which the network without an ingredient collides and the one with it arrives, if any."""
    added = ROWS[row].rounds or ROWS[row].otherwise
    pair = (EVERYTHING, row) if added else (row, EVERYTHING)
    tests = tests_of(scene, home)
    worse, better = (tried(scene, name, home, tests) for name in pair)
    found = np.flatnonzero((worse.failure == COLLIDED) & (better.failure == ""))
    if len(found):
        test = int(found[0])
        shots = [
            one.shot(tests.position[test], test, name)
            for one, name in zip((worse, better), pair, strict=True)
        ]
        write_shots(
            folder / f"{scene.replace(':', '-')}-{row.replace(',', '').replace(' ', '-')}.png", shots, SIZE
        )


@dataclass(frozen=True)
class Tried:
    """What the first network of a row did at the tests."""

    study: StudyContext
    pool: PoolContext
    policy: TrainedPolicy
    goals: FloatArray | None
    failure: npt.NDArray[np.object_]

    def shot(self, position: FloatArray, test: int, title: str) -> Shot:
        """The rollout at one test."""
        goal = None if self.goals is None else self.goals[test][None]
        robot, scene, dt = self.pool.robot, self.pool.scene, self.pool.settings.timing.dt
        run = rollout_run(self.policy, robot, scene, position, self.study.config.evaluation, dt, goal)
        return Shot(robot, scene, (run,), title=title)


def tried(scene: str, row: str, home: Path, tests: TargetsUnderTest) -> Tried:
    """Roll the first network of a row out."""
    study, pool = opened(scene, row, home, 1)
    policy = networks_of(study, pool, row)[0]
    goals = goals_shown(study, pool, row, policy, tests)
    (table,) = rolled_out(study, pool, row, [policy], tests)
    return Tried(study, pool, policy, goals, table["failure"].to_numpy(zero_copy_only=False))


if __name__ == "__main__":
    try:
        main()
    except PlancurateError as error:
        sys.exit(f"{error}")
