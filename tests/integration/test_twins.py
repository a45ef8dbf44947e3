"""Selections that keep the same trajectories: their networks are trained and rolled out once."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest
import torch

from plancurate.tasks.lake.home import Home
from plancurate.tasks.learning import rollouts, train
from plancurate.tasks.learning.demonstrations import Demonstrations
from plancurate.tasks.learning.policies import TrainedPolicy
from plancurate.tasks.study.config import load_config
from plancurate.tasks.study.context import StudyContext, open_study
from plancurate.tasks.study.evaluations import evaluate_networks, evaluation_id
from plancurate.tasks.study.networks import (
    Network,
    load_network,
    network_folder,
    train_networks,
    wanted_networks,
)
from plancurate.tasks.study.selections import study_selections

from .conftest import Studied

FIELDS = {
    "selectors": ["KMeans_Hybrid", "General", "Hierarchical_Hybrid"],
    "policies": ["BC_MLP"],
    "training": {"steps": 5},
}


@pytest.fixture
def study(smoke: Studied, tmp_path: Path) -> StudyContext:
    shutil.copytree(smoke.untouched / "lake", tmp_path / "lake")
    return open_study(load_config("smoke", None, FIELDS), Home.resolve(tmp_path))


def test_twins_are_trained_and_rolled_out_once_and_recorded_each(
    study: StudyContext, monkeypatch: pytest.MonkeyPatch
) -> None:
    done: list[tuple[str, int]] = []
    first, general, twin = wanted_networks(study, study_selections(study))
    alone = trained_alone(study, twin)
    count_calls(monkeypatch, done)
    train_networks(study, [first, general, twin])
    evaluate_networks(study, [first, general, twin])
    assert done == [("train", 2), ("roll_out", 2)]
    for name, weights in load_network(study, twin).weights.items():
        assert torch.equal(weights, alone[name])
    (pool,) = study.pools
    tables = [
        study.lake.query(
            "study/trials", evaluation_id=evaluation_id(study, network), **study.study_partition(pool)
        )
        for network in (first, twin)
    ]
    own = ["evaluation_id", "selection_id", "selector", "selection_time_s", "train_s"]
    assert tables[0].drop_columns(own).equals(tables[1].drop_columns(own))
    assert {table["selector"][0].as_py() for table in tables} == {"KMeans_Hybrid", "Hierarchical_Hybrid"}


def count_calls(patch: pytest.MonkeyPatch, done: list[tuple[str, int]]) -> None:
    """Note in `done` how many networks each training and rollout is of."""
    train_all, roll_out_all = train.train, rollouts.roll_out

    def trained(policy: str, data: Sequence[Demonstrations], *more: Any) -> list[TrainedPolicy]:
        done.append(("train", len(data)))
        return train_all(policy, data, *more)

    def rolled_out(policies: Sequence[TrainedPolicy], *more: Any) -> list[pa.Table]:
        done.append(("roll_out", len(policies)))
        return roll_out_all(policies, *more)

    patch.setattr(train, "train", trained)
    patch.setattr(rollouts, "roll_out", rolled_out)


def trained_alone(study: StudyContext, network: Network) -> dict[str, torch.Tensor]:
    """Weights of a network that no other one is trained with; it is not left behind."""
    train_networks(study, [network])
    weights = load_network(study, network).weights
    shutil.rmtree(network_folder(study, network))
    return dict(weights)
