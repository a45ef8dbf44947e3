"""What the parameters of selectors do to the success of a policy, on development targets alone.

    python experiments/parameters.py [--home data/development] [--json rates.json]

Every row is a selection from the pools of development.yaml, for half of its targets, that differs from the first row of
its group in one parameter. BC_MLP is trained on it, once for each selection seed and training seed, and rolled out at
unseen development targets. A gain is over the first row of the group, on the same targets; intervals are the study's
own, over seeds and targets.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import torch

from plancurate.errors import PlancurateError
from plancurate.tasks.candidates.targets import sample_targets
from plancurate.tasks.curation.selector_choice import SelectorChoice
from plancurate.tasks.lake.home import Home
from plancurate.tasks.learning.rollouts import roll_out
from plancurate.tasks.learning.test_targets import unseen_tests
from plancurate.tasks.learning.train import train
from plancurate.tasks.study.bootstrap import paired_difference, rate_interval
from plancurate.tasks.study.config import load_config
from plancurate.tasks.study.context import PoolContext, StudyContext, open_study
from plancurate.tasks.study.demonstrations import selected_demonstrations
from plancurate.tasks.study.rows import ALL_SCENES, Cell
from plancurate.tasks.study.selections import WantedSelection, make_selection, study_pool, study_selections
from plancurate.tasks.study.statistics import Interval
from plancurate.tasks.study.trials import Bootstrap, NetworkTrials

CONFIG = Path(__file__).with_name("development.yaml")
POLICY = "BC_MLP"
OPTIONS = {"n_targets": 48, "budgets": [3], "selection_seeds": [0, 1], "training": {"steps": 2000}}
Choice = dict[str, Any]
Groups = Mapping[str, Sequence[Choice]]


def one_at_a_time(name: str, **values: Sequence[Any]) -> list[Choice]:
    """A selector as it is, then with one of its parameters set to each of some values."""
    return [{"name": name}, *({"name": name, key: value} for key in values for value in values[key])]


GROUPS: Groups = {
    "controls": [{"name": "Random"}, {"name": "General"}],
    "KMeans_Hybrid": one_at_a_time("KMeans_Hybrid", clusters_share=(0.25, 0.5, 2.0)),
    "DBSCAN_Hybrid": one_at_a_time("DBSCAN_Hybrid", eps_share=(0.25, 2.0)),
    "ModeConsistent": one_at_a_time(
        "ModeConsistent",
        radius=(0.5, 2.0),
        agreement=(0.0, 20.0),
        neighbours=(3,),
        leave_out=(0.0,),
    ),
    "BehaviorRetrieval_Native": one_at_a_time("BehaviorRetrieval_Native", kept_share=(0.1, 0.5)),
    "SCIZOR_Native": one_at_a_time("SCIZOR_Native", kept_share=(0.5, 0.9)),
}


@dataclass(frozen=True)
class Rate:
    """Success of a selection over scenes, seeds and targets, and its gain over the first of its group; 1 is 100 %."""

    group: str
    selector: str
    success: float
    interval: Interval
    gain: float
    gain_interval: Interval
    by_scene: Mapping[str, float]
    kept_a_target: float
    joint_movement: float
    """Mean over the kept trajectories, rad."""


def main() -> None:
    """Measure every group."""
    compare(__doc__ or "", GROUPS, seeds=1)


def compare(description: str, groups: Groups, seeds: int) -> None:
    """Read the command line, generate what is missing, measure the groups asked for and print a line for each row."""
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--home", type=Path, default=Path("data/development"))
    parser.add_argument("--groups", nargs="*", default=list(groups), choices=list(groups))
    parser.add_argument("--json", type=Path)
    asked = parser.parse_args()
    command = [sys.executable, "-m", "plancurate.flows.cli.app", "generate", "--config", CONFIG]
    options = ["--home", asked.home, "--n-targets", str(OPTIONS["n_targets"])]
    subprocess.run([*command, *options], check=True)
    rates = measured(asked.home, {name: groups[name] for name in asked.groups}, seeds)
    print(*map(line, rates), sep="\n")
    if asked.json:
        asked.json.write_text(json.dumps([asdict(rate) for rate in rates], indent=1) + "\n", encoding="utf-8")


def line(rate: Rate) -> str:
    """A rate for a person, in percent."""
    success, gain = percent(rate.success, rate.interval), percent(rate.gain, rate.gain_interval)
    scenes = ", ".join(f"{scene} {100 * value:.1f}" for scene, value in rate.by_scene.items())
    kept = f"kept {rate.kept_a_target:.1f} a target, {rate.joint_movement:.2f} rad"
    return f"{rate.group:24} {rate.selector:44} {success}  gain {gain}  {scenes}  {kept}"


def percent(value: float, interval: Interval) -> str:
    """A rate or a difference of rates with its interval."""
    return f"{100 * value:5.1f} ({100 * interval.low:.1f} to {100 * interval.high:.1f})"


def measured(home: Path, groups: Groups, seeds: int) -> list[Rate]:
    """Train and test on the selections of all groups in all scenes, each from so many training seeds."""
    warnings.simplefilter("ignore")
    torch.set_num_threads(1)
    choices = [choice for group in groups.values() for choice in group]
    study = open_study(load_config("smoke", CONFIG, {**OPTIONS, "selectors": choices}), Home.resolve(home))
    wanted = study_selections(study)
    trials = [trial for pool in study.pools for trial in trials_of(study, pool, wanted, seeds)]
    drawn = {
        cell.selector: some for cell, some in Bootstrap(trials).draw().items() if cell.scene == ALL_SCENES
    }
    rates = []
    for group, rows in groups.items():
        for label in map(label_of, rows):
            gain = paired_difference(drawn[label].counts, drawn[label_of(rows[0])].counts)
            kept = kept_of(study, [one for one in wanted if one.choice.label == label])
            interval, by_scene = rate_interval(drawn[label].counts), scene_rates(trials, label)
            success = float(np.mean(list(by_scene.values())))
            rates.append(
                Rate(group, label, success, interval, gain.value, gain.interval(1.0), by_scene, *kept)
            )
    return rates


def label_of(choice: Choice) -> str:
    """The selector's name in tables."""
    return SelectorChoice.model_validate(choice).label


def trials_of(
    study: StudyContext, pool: PoolContext, wanted: Sequence[WantedSelection], seeds: int
) -> Iterator[NetworkTrials]:
    """Networks trained and tested on the selections of one pool, all at once."""
    pairs = [(one, seed) for one in wanted if one.pool == pool.pool for seed in range(seeds)]
    data = [selected_demonstrations(study, one) for one, _ in pairs]
    trained = train(POLICY, data, [seed for _, seed in pairs], study.config.training)
    targets = pool.settings.targets.model_copy(update={"seed": study.config.evaluation.seed})
    tests = unseen_tests(sample_targets(pool.robot, pool.scene, targets, 0, study.config.unseen))
    tables = roll_out(
        trained, pool.robot, pool.scene, tests, study.config.evaluation, pool.settings.timing.dt
    )
    for (one, seed), table in zip(pairs, tables, strict=True):
        cell = Cell(pool.scene.name, "", one.choice.label, one.budget)
        success, settled = (np.array(table[name].to_pylist()) for name in ("success", "settled"))
        yield NetworkTrials(cell, POLICY, one.seed, seed, tests.test_id, success, settled, tests.distance_cm)


def scene_rates(trials: Sequence[NetworkTrials], selector: str) -> dict[str, float]:
    """Success of a selector's networks in each scene."""
    own = [trial for trial in trials if trial.cell.selector == selector]
    return {
        scene: float(np.mean([trial.success for trial in own if trial.cell.scene == scene]))
        for scene in dict.fromkeys(trial.cell.scene for trial in own)
    }


def kept_of(study: StudyContext, wanted: Sequence[WantedSelection]) -> tuple[float, float]:
    """Kept trajectories of each selection a target, and their mean joint movement, rad."""
    counts, movements = [], []
    for one in wanted:
        pool = study_pool(study, study.pool(one.pool))
        ids = pa.array(make_selection(study, one).ids)
        kept = pool.candidates.filter(pc.is_in(pool.candidates["trajectory_id"], ids))
        counts.append(len(kept) / pool.n_targets)
        movements.append(pc.mean(kept["joint_movement"]).as_py())
    return float(np.mean(counts)), float(np.mean(movements))


if __name__ == "__main__":
    try:
        main()
    except PlancurateError as error:
        sys.exit(f"{error}")
