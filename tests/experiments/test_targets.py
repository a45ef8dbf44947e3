"""Which targets an experiment may read: never those that a study trains or tests on."""

from __future__ import annotations

from pathlib import Path

import pytest

from plancurate.tasks.study.config import StudyConfig, load_config, preset_names
from plancurate.tasks.study.evaluations import UNSEEN_SEED_OFFSET

EXPERIMENTS = Path(__file__).parents[2] / "experiments"
SCRIPTS = {
    "alike": "development",
    "clutter": "clutter",
    "defaults": "development",
    "hard_scenes": "hard_scenes",
    "parameters": "development",
}  # each script with the configuration that it reads, and reads alone
MEASURING = {"authors", "predictions", "verifier"}
"""Experiments by which no setting is chosen: they measure what stands."""
PARTS = {"clearance_labels": "hard_scenes", "mean_policy": "clutter"}
"""Modules that read no targets of their own, each with the script that gives them some."""


def seeds(config: StudyConfig) -> set[int]:
    """Seeds of the targets that a configuration trains or tests on."""
    training = {config.pool_settings(label).targets.seed for label in config.pool_labels}
    return training | {config.evaluation.seed, config.evaluation.seed + UNSEEN_SEED_OFFSET}


def test_every_experiment_is_listed_here() -> None:
    assert {path.stem for path in EXPERIMENTS.glob("*.py")} == SCRIPTS.keys() | MEASURING | PARTS.keys()


@pytest.mark.parametrize("module", PARTS)
def test_a_part_of_an_experiment_opens_no_configuration_or_targets(module: str) -> None:
    assert f"from {module} import" in (EXPERIMENTS / f"{PARTS[module]}.py").read_text()
    text = (EXPERIMENTS / f"{module}.py").read_text()
    assert not [name for name in ("load_config", "sample_targets", ".yaml", "unseen_tests") if name in text]


@pytest.mark.parametrize("script", SCRIPTS)
def test_an_experiment_reads_its_configuration(script: str) -> None:
    assert f"{SCRIPTS[script]}.yaml" in (EXPERIMENTS / f"{script}.py").read_text()


@pytest.mark.parametrize("configuration", sorted(EXPERIMENTS.glob("*.yaml")), ids=lambda path: path.stem)
def test_an_experiment_reads_no_target_of_a_preset(configuration: Path) -> None:
    development = seeds(load_config("smoke", configuration, {}))
    for preset in preset_names():
        assert development.isdisjoint(seeds(load_config(preset, None, {}))), preset
