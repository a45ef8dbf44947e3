"""What it takes to reach targets among obstacles: each ingredient left out in turn, on development targets alone.

    python experiments/hard_scenes.py [--home data/hard_scenes] [--seeds 2] [--json rates.json]

Plans in four scenes with the ingredients (orientation tolerance, clearance while planning) and without each, trains
BC_MLP on each selection with and without arc steps and the goal term, and rolls out on unseen targets of the same
seed: in all, and on the hard ones, whose straight joint line is not free.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import warnings
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import torch

from plancurate.errors import PlancurateError
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.targets import sample_targets
from plancurate.tasks.lake.home import Home
from plancurate.tasks.learning.policies import TrainedPolicy
from plancurate.tasks.learning.rollouts import roll_out
from plancurate.tasks.learning.test_targets import TargetsUnderTest, reachable_tests, unseen_tests
from plancurate.tasks.learning.train import train
from plancurate.tasks.motion.rollout import goals_of as goals_shown
from plancurate.tasks.study.config import load_config
from plancurate.tasks.study.context import PoolContext, StudyContext, open_study
from plancurate.tasks.study.demonstrations import selected_demonstrations
from plancurate.tasks.study.selections import study_selections

CONFIG = Path(__file__).with_name("hard_scenes.yaml")
OURS, NO_GOAL = "ModeConsistent", ["target_offset", "joint_positions"]
# Ingredients: pool, selector, settings of training. Each row but the first changes one or two of them.
ROWS: dict[str, tuple[str, str, dict[str, Any]]] = {
    "everything": ("all", OURS, {}),
    "no orientation tolerance": ("exact", OURS, {}),
    "no clearance": ("close", OURS, {}),
    "global ranking instead of ways": ("all", "RuleBased_General", {}),
    "KMeans_Hybrid instead of ways": ("all", "KMeans_Hybrid", {}),
    "random instead of ways": ("all", "Random", {}),
    "ways, no target left out": ("all", f"{OURS}(leave_out=0.0)", {}),
    "consistent goals": ("consistent", OURS, {}),
    "consistent goals, no target left out": ("consistent", f"{OURS}(leave_out=0.0)", {}),
    "consistent goals, global ranking": ("consistent", "RuleBased_General", {}),
    "consistent goals, random": ("consistent", "Random", {}),
    "time steps": ("all", OURS, {"demonstration_steps": "time"}),
    "no goal term": ("all", OURS, {"observation": NO_GOAL}),
    "no goal term, global ranking": ("all", "RuleBased_General", {"observation": NO_GOAL}),
    "no goal term, KMeans_Hybrid": ("all", "KMeans_Hybrid", {"observation": NO_GOAL}),
    "no goal term, random": ("all", "Random", {"observation": NO_GOAL}),
}


@dataclass(frozen=True)
class Rate:
    """Counts over `n` unseen targets and training seeds; `hard` ones are those whose straight line is not free."""

    scene: str
    row: str
    n: int
    successes: int
    settled: int
    hard_n: int
    hard_successes: int
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


def line(rate: Rate) -> str:
    """A rate for a person."""
    hard = 100 * rate.hard_successes / rate.hard_n if rate.hard_n else float("nan")
    shares = (
        f"{100 * rate.successes / rate.n:5.1f} settled {100 * rate.settled / rate.n:5.1f} hard {hard:5.1f}"
    )
    return f"{rate.scene:9} {rate.row:32} {shares}  n {rate.n} hard {rate.hard_n}  {rate.failures}"


def measure(wanted: tuple[str, str, int, Path]) -> Rate:
    """Train on one selection in one scene and roll out."""
    scene, row, seeds, home = wanted
    warnings.simplefilter("ignore")
    torch.set_num_threads(1)
    label, selector, training = ROWS[row]
    study, pool = opened(scene, label, home, training)
    data = demonstrations_of(study, pool, selector)
    trained = train("BC_MLP", [data] * seeds, range(seeds), study.config.training)
    tests = tests_of(scene, home)
    goals = goals_of(trained, pool, tests, study.config.evaluation.seed)
    tables = roll_out(
        trained, pool.robot, pool.scene, tests, study.config.evaluation, pool.settings.timing.dt, goals
    )
    return counted(scene, row, tests, tables)


def demonstrations_of(study: StudyContext, pool: PoolContext, selector: str) -> Any:
    """What a selector keeps of a pool."""
    wanted = [s for s in study_selections(study) if (s.pool, s.choice.label) == (pool.pool, selector)]
    return selected_demonstrations(study, wanted[0])


def opened(scene: str, label: str, home: Path, training: dict[str, Any]) -> tuple[StudyContext, PoolContext]:
    """The study with these settings of training in one scene, and its pool of that label."""
    config = load_config("smoke", CONFIG, {"training": training, "scenes": [scene]})
    study = open_study(config, Home.resolve(home))
    return study, next(pool for pool in study.pools if pool.label == label)


@cache
def tests_of(scene: str, home: Path) -> TargetsUnderTest:
    """Unseen targets of a scene, the same for all rows: drawn with the orientation tolerance."""
    study, pool = opened(scene, "all", home, {})
    seed = study.config.evaluation.seed
    settings = pool.settings.targets.model_copy(update={"seed": seed})
    tests = unseen_tests(sample_targets(pool.robot, pool.scene, settings, 0, study.config.unseen))
    return reachable_tests(tests, pool.robot, pool.scene, pool.settings, seed)


def goals_of(
    trained: Sequence[TrainedPolicy], pool: PoolContext, tests: TargetsUnderTest, seed: int
) -> FloatArray | None:
    """Goal configurations (networks, tests, n), where the networks are shown any."""
    goals = [
        goals_shown(policy, pool.robot, pool.scene, tests.position, pool.settings.targets, seed)
        for policy in trained
    ]
    shown = [one for one in goals if one is not None]
    return np.stack(shown) if shown else None


def counted(scene: str, row: str, tests: TargetsUnderTest, tables: Sequence[Any]) -> Rate:
    """Counts over all networks."""
    success, settled = (
        np.array([table[name].to_pylist() for table in tables]) for name in ("success", "settled")
    )
    reasons = [reason for table in tables for reason in table["failure"].to_pylist() if reason]
    return Rate(
        scene, row, success.size, int(success.sum()), int(settled.sum()), int(tests.hard.sum() * len(tables)),
        int(success[:, tests.hard].sum()), {name: reasons.count(name) for name in sorted(set(reasons))},
    )  # fmt: skip


if __name__ == "__main__":
    try:
        main()
    except PlancurateError as error:
        sys.exit(f"{error}")
