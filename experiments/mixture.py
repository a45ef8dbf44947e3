"""What makes the mixture-density policy reliable: one setting changed at a time.

    python experiments/mixture.py [--home data] [--preset quick] [--seeds 3]

Needs the candidates of a study in the home folder (`plancurate generate --preset quick`). Trains BC_RNN_MDN on what
KMeans_Hybrid keeps and on the whole pool, and rolls it out on displaced targets of a seed of its own: the study's
tests stay untouched.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import torch

from plancurate.errors import PlancurateError
from plancurate.tasks.candidates.target_table import stored_targets
from plancurate.tasks.lake.home import Home
from plancurate.tasks.learning.demonstrations import Demonstrations
from plancurate.tasks.learning.rollouts import roll_out
from plancurate.tasks.learning.settings import EvaluateSettings, TrainSettings
from plancurate.tasks.learning.test_targets import displaced_tests
from plancurate.tasks.learning.train import train
from plancurate.tasks.study.config import load_config
from plancurate.tasks.study.context import StudyContext, open_study
from plancurate.tasks.study.networks import selected_demonstrations
from plancurate.tasks.study.selections import study_selections

TEST_SEED = 2000  # not the studies'
POLICY = "BC_RNN_MDN"
SELECTORS = ("KMeans_Hybrid", "General")
VARIANTS: dict[str, dict[str, Any]] = {
    "defaults": {},
    "min_std 0.0001": {"min_std": 1e-4},
    "min_std 0.01": {"min_std": 0.01},
    "min_std 0.3": {"min_std": 0.3},
    "no weight decay": {"weight_decay": 0.0},
    "min_std 0.0001, no weight decay": {"min_std": 1e-4, "weight_decay": 0.0},
    "mean of the mixture": {"mode": "mean"},
    "one component": {"components": 1},
    "twenty components": {"components": 20},
}


def main() -> None:
    """Train and test every variant on both selections."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--home", type=Path)
    parser.add_argument("--preset", default="quick")
    parser.add_argument("--seeds", type=int, default=3)
    asked = parser.parse_args()
    warnings.simplefilter("ignore")
    torch.set_num_threads(1)
    study = open_study(load_config(asked.preset, None, {}), Home.resolve(asked.home))
    for wanted in study_selections(study):
        if wanted.choice.name not in SELECTORS:
            continue
        print(f"{wanted.title}: success, settled (percent); heaviest weight, components at work, spread")
        data = selected_demonstrations(study, wanted)
        for name, change in VARIANTS.items():
            print(f"  {name:33s} {measured(study, data, change, asked.seeds)}", flush=True)


def measured(study: StudyContext, data: Demonstrations, change: dict[str, Any], seeds: int) -> str:
    """Success and settled rate over all seeds, and the means of what the networks tell of themselves."""
    training = {name: value for name, value in change.items() if name == "weight_decay"}
    policy = {name: value for name, value in change.items() if name != "weight_decay"}
    settings = TrainSettings(policies={POLICY: policy}, **training)
    trained = train(POLICY, [data] * seeds, list(range(seeds)), settings)
    pool = study.pools[0]
    targets = stored_targets(study.lake, pool.partition)[: study.config.n_targets]
    tests = displaced_tests(targets, TEST_SEED)
    tables = roll_out(trained, pool.robot, pool.scene, tests, EvaluateSettings(), pool.settings.timing.dt)
    rates = [
        np.mean([table[column].to_numpy().mean() for table in tables]) for column in ("success", "settled")
    ]
    told = {name: np.mean([t.diagnostics[name] for t in trained]) for name in trained[0].diagnostics}
    percent = "  ".join(f"{100 * rate:5.1f}" for rate in rates)
    return percent + "   " + "  ".join(f"{value:5.2f}" for value in told.values())


if __name__ == "__main__":
    try:
        main()
    except PlancurateError as error:
        sys.exit(f"{error}")
