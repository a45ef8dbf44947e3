"""How the policies' default settings were chosen: one setting changed at a time, on development targets alone.

    python experiments/defaults.py [--home data/development] [--write]

Plans for targets that no study trains or tests on (development.yaml), selects from them in several ways, trains every
policy with every variant of its settings on each selection, and rolls the networks out on unseen targets of the same
seed. A setting is as good as its mean success over scenes and selectors: so it favours no selector. `--write` keeps
the rates where reports find them (tasks/report/development.json).
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import warnings
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import torch

from plancurate.errors import PlancurateError
from plancurate.tasks.candidates.targets import sample_targets
from plancurate.tasks.lake.home import Home
from plancurate.tasks.learning.rollouts import roll_out
from plancurate.tasks.learning.test_targets import unseen_tests
from plancurate.tasks.learning.train import train
from plancurate.tasks.report.development import BASE_ROW, RATES
from plancurate.tasks.study.config import POLICIES, load_config
from plancurate.tasks.study.context import PoolContext, StudyContext, open_study
from plancurate.tasks.study.demonstrations import selected_demonstrations
from plancurate.tasks.study.selections import study_selections
from plancurate.yaml_files import merged

CONFIG = Path(__file__).with_name("development.yaml")
# What each row changes: the first edition's settings, whatever the defaults are now.
BASE: dict[str, Any] = {
    "steps": 2000,
    "weight_decay": 1.0,
    "demonstration_steps": "time",
    "policies": {
        "BC_MLP": {"hidden": [128, 128]},
        "BC_RNN": {"hidden": 64},
        "BC_RNN_Dropout": {"hidden": 64, "dropout": 0.2},
        "BC_RNN_MDN": {"hidden": 64, "min_std": 0.3},
    },
}
COMMON: dict[str, dict[str, Any]] = {
    BASE_ROW: {},
    "weight_decay 0": {"weight_decay": 0.0},
    "weight_decay 0.01": {"weight_decay": 0.01},
    "weight_decay 0.1": {"weight_decay": 0.1},
    "arc steps": {"demonstration_steps": "arc"},
    "steps x 5": {"steps": 10_000},
}
"""Settings of training, the same for every policy."""
OWN: dict[str, dict[str, dict[str, Any]]] = {
    "BC_MLP": {"hidden 256-256": {"hidden": [256, 256]}, "relu": {"activation": "relu"}},
    "BC_RNN": {"hidden 128": {"hidden": 128}},
    "BC_RNN_Dropout": {"dropout 0.1": {"dropout": 0.1}, "dropout 0.5": {"dropout": 0.5}},
    "BC_RNN_MDN": {"min_std 0.01": {"min_std": 0.01}},
}
"""Settings of single policies."""


@dataclass(frozen=True)
class Rate:
    """Success of one policy with one variant of its settings, trained on one selection."""

    scene: str
    selector: str
    policy: str
    variant: str
    n: int
    successes: int
    settled: int
    """Rollouts that were at the target at the step limit."""


def main() -> None:
    """Train and test every variant on every selection of every scene."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--home", type=Path, default=Path("data/development"))
    parser.add_argument("--write", action="store_true", help="keep the rates for reports")
    parser.add_argument("--variants", nargs="*", help="only these variants")
    asked = parser.parse_args()
    command = [sys.executable, "-m", "plancurate.flows.cli.app", "generate"]
    subprocess.run([*command, "--config", CONFIG, "--home", asked.home], check=True)
    wanted = [(*names, asked.home) for names in variants(asked.variants)]
    rates: list[Rate] = []
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as processes:
        for (policy, variant, _), some in zip(wanted, processes.map(measure, wanted), strict=True):
            success, settled = (
                100 * sum(counts) / sum(rate.n for rate in some)
                for counts in ([rate.successes for rate in some], [rate.settled for rate in some])
            )
            print(f"{policy:15} {variant:20} {success:5.1f} settled {settled:5.1f}", flush=True)
            rates += some
    if asked.write:
        RATES.write_text(json.dumps([asdict(rate) for rate in rates], indent=0) + "\n", encoding="utf-8")


def variants(names: list[str] | None) -> Iterator[tuple[str, str]]:
    """Pairs of policy and variant."""
    for policy in POLICIES:
        for variant in (*COMMON, *OWN[policy]):
            if not names or variant in names:
                yield policy, variant


def measure(wanted: tuple[str, str, Path]) -> list[Rate]:
    """Train one policy with one variant on all selections, and count its successes at unseen development targets."""
    policy, variant, home = wanted
    warnings.simplefilter("ignore")
    torch.set_num_threads(1)
    changed = COMMON[variant] if variant in COMMON else {"policies": {policy: OWN[policy][variant]}}
    config = load_config("smoke", CONFIG, {"training": merged(BASE, changed)})
    study = open_study(config, Home.resolve(home))
    return [rate for pool in study.pools for rate in measure_pool(study, pool, policy, variant)]


def measure_pool(study: StudyContext, pool: PoolContext, policy: str, variant: str) -> list[Rate]:
    """Train and test on the selections of one pool, all at once."""
    selections = [wanted for wanted in study_selections(study) if wanted.pool == pool.pool]
    data = [selected_demonstrations(study, wanted) for wanted in selections]
    trained = train(policy, data, [0] * len(data), study.config.training)
    settings = pool.settings.targets.model_copy(update={"seed": study.config.evaluation.seed})
    tests = unseen_tests(sample_targets(pool.robot, pool.scene, settings, 0, study.config.unseen))
    tables = roll_out(
        trained, pool.robot, pool.scene, tests, study.config.evaluation, pool.settings.timing.dt
    )
    return [
        Rate(
            pool.scene.name,
            wanted.title,
            policy,
            variant,
            len(tests),
            sum(table["success"].to_pylist()),
            sum(table["settled"].to_pylist()),
        )
        for wanted, table in zip(selections, tables, strict=True)
    ]


if __name__ == "__main__":
    try:
        main()
    except PlancurateError as error:
        sys.exit(f"{error}")
