from __future__ import annotations

import json
import math
import random
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from plancurate.errors import PlancurateError
from plancurate.tasks.lake.manifest import list_files
from plancurate.tasks.learning.policies import (
    Normaliser,
    TrainedPolicy,
    load_policy,
    make_policy,
    policy_names,
)

FILES = ("policy.json", "policy.safetensors")
LAYOUT = (("target_offset", 3), ("joint_positions", 6))


def trained(name: str) -> TrainedPolicy:
    rng = torch.Generator().manual_seed(1)
    policy = make_policy(name, {"hidden": (8,) if name == "BC_MLP" else 8})
    scale = [torch.rand(size, generator=rng) + 0.1 for size in (9, 9, 6, 6)]
    return TrainedPolicy(
        policy,
        policy.initial(9, 6, rng),
        Normaliser(*scale),
        LAYOUT,
        "delta",
        10,
        5,
        1.5,
        [(10, 0.5), (20, 0.25)],
    )


@pytest.mark.parametrize("name", policy_names())
def test_stored_policy_comes_back_bit_for_bit(tmp_path: Path, name: str) -> None:
    policy = trained(name)
    policy.save(tmp_path / "policy")
    found = load_policy(tmp_path / "policy")
    assert found.policy == policy.policy
    assert found.weights.keys() == policy.weights.keys()
    assert all(torch.equal(found.weights[key], value) for key, value in policy.weights.items())
    for key, value in vars(policy.normaliser).items():
        assert torch.equal(getattr(found.normaliser, key), value)
    for key in ("layout", "action", "window", "seed", "train_s", "loss_curve"):
        assert getattr(found, key) == getattr(policy, key)


def test_policy_whose_training_diverged_can_be_stored_and_read(tmp_path: Path) -> None:
    replace(trained("BC_RNN"), loss_curve=[(10, math.inf), (20, math.nan)]).save(tmp_path)
    losses = [loss for _, loss in load_policy(tmp_path).loss_curve]
    assert losses[0] == math.inf
    assert math.isnan(losses[1])


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(PlancurateError, match=r"policy.json: no such file"):
        load_policy(tmp_path)
    trained("BC_RNN").save(tmp_path)
    (tmp_path / "policy.safetensors").unlink()
    with pytest.raises(PlancurateError, match=r"policy.safetensors: no such file"):
        load_policy(tmp_path)


@pytest.mark.parametrize("change", [{"format": 9}, {"window": "ten"}, {"extra": 1}])
def test_description_that_is_wrong_names_the_file_and_field(
    tmp_path: Path, change: dict[str, object]
) -> None:
    trained("BC_RNN").save(tmp_path)
    file = tmp_path / "policy.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | change))
    list_files(tmp_path, FILES)
    with pytest.raises(PlancurateError, match=rf"policy.json: {next(iter(change))}( = .*)?: "):
        load_policy(tmp_path)


def test_tensors_that_are_no_tensors_or_of_other_sizes_are_refused(tmp_path: Path) -> None:
    trained("BC_RNN").save(tmp_path)
    file = tmp_path / "policy.json"
    file.write_text(file.read_text().replace('"hidden": 8', '"hidden": 9'))
    list_files(tmp_path, FILES)
    with pytest.raises(PlancurateError, match=r"weights.gru_0.input is \(9, 24\); BC_RNN has \(9, 27\)"):
        load_policy(tmp_path)
    (tmp_path / "policy.safetensors").write_bytes(b"\x80\x04pickle")
    list_files(tmp_path, FILES)
    with pytest.raises(PlancurateError, match=r"policy.safetensors: not a safetensors file"):
        load_policy(tmp_path)


@pytest.mark.parametrize("name", FILES)
def test_a_changed_byte_is_refused(tmp_path: Path, name: str) -> None:
    trained("BC_MLP").save(tmp_path)
    whole, chance = (tmp_path / name).read_bytes(), random.Random(0)
    for position in chance.sample(range(len(whole)), 30):
        content = bytearray(whole)
        content[position] ^= 1 << chance.randrange(8)
        (tmp_path / name).write_bytes(content)
        with pytest.raises(
            PlancurateError, match=rf"{name}: changed since it was written.*train again"
        ) as caught:
            load_policy(tmp_path)
        assert "\n" not in str(caught.value)


def test_a_policy_without_its_manifest_is_refused(tmp_path: Path) -> None:
    trained("BC_MLP").save(tmp_path)
    (tmp_path / "manifest.jsonl").unlink()
    with pytest.raises(PlancurateError, match=r"manifest\.jsonl: no such file"):
        load_policy(tmp_path)
