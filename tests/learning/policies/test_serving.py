from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pandas as pd
import pytest
import torch

from plancurate.errors import PlancurateError
from plancurate.tasks.learning.policies import Normaliser, TrainedPolicy, make_policy, serving
from plancurate.tasks.learning.policies.acting import ActingStack

LAYOUT = (("target_offset", 3), ("joint_positions", 6))


def trained(name: str) -> TrainedPolicy:
    rng = torch.Generator().manual_seed(1)
    policy = make_policy(name, {})
    scale = [torch.rand(size, generator=rng) + 0.1 for size in (9, 9, 6, 6)]
    return TrainedPolicy(
        policy, policy.initial(9, 6, rng), Normaliser(*scale), LAYOUT, "delta", window=4, seed=0
    )


def observations(*shape: int) -> np.ndarray:
    return np.random.default_rng(2).normal(size=(*shape, 9))


@pytest.mark.parametrize("name", ["BC_MLP", "BC_RNN", "BC_RNN_MDN"])
def test_rows_are_successive_steps_of_one_rollout(name: str) -> None:
    policy, rows = trained(name), observations(7)
    stack = ActingStack([policy])
    seen = torch.from_numpy(rows)[:, None, None]
    expected = [stack.next_q(row, row[..., 3:])[0, 0].numpy() for row in seen]
    served = serving.ServedPolicy(policy)
    np.testing.assert_allclose(served.predict(rows), expected, rtol=1e-6)
    np.testing.assert_array_equal(served.predict(pd.DataFrame(rows)), served.predict(rows))


def test_windows_are_answered_after_their_last_step() -> None:
    served, windows = serving.ServedPolicy(trained("BC_RNN")), observations(5, 3)
    expected = [served.predict(window)[-1] for window in windows]
    np.testing.assert_allclose(served.predict(windows), expected, rtol=1e-6)


def test_input_of_another_shape_is_refused() -> None:
    with pytest.raises(
        PlancurateError,
        match=r"shape \(4, 8\); rows of 9 numbers .* target_offset \(3\), joint_positions \(6\)$",
    ):
        serving.ServedPolicy(trained("BC_MLP")).predict(np.zeros((4, 8)))


def test_joint_angles_stand_behind_an_observation_without_them() -> None:
    policy = trained("BC_MLP")
    renamed = replace(policy, layout=(("target_offset", 3), ("last_action", 6)))
    rows, q = observations(4), observations(4)[:, :6] + 1
    with pytest.raises(
        PlancurateError, match=r"rows of 15 numbers .* last_action \(6\) and joint angles \(6\)"
    ):
        serving.ServedPolicy(renamed).predict(rows)
    following = serving.ServedPolicy(renamed).predict(np.concatenate([rows, q], axis=1))
    expected = serving.ServedPolicy(policy).predict(rows) - rows[:, 3:] + q
    np.testing.assert_allclose(following, expected, atol=1e-9)


@pytest.mark.filterwarnings("default")
def test_mlflow_serves_a_stored_policy_without_unpickling(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import mlflow.pyfunc

    policy = trained("BC_RNN")
    policy.save(tmp_path / "policy")
    mlflow.pyfunc.save_model(
        str(tmp_path / "model"),
        loader_module=serving.__name__,
        data_path=str(tmp_path / "policy"),
        pip_requirements=["plancurate"],
    )

    def refuse(*args: Any, **kwargs: Any) -> NoReturn:
        raise AssertionError("unpickled")

    for name in ("load", "loads", "Unpickler"):
        monkeypatch.setattr(pickle, name, refuse)
    rows = observations(6)
    model = mlflow.pyfunc.load_model(str(tmp_path / "model"))
    np.testing.assert_allclose(model.predict(rows), serving.ServedPolicy(policy).predict(rows), rtol=1e-6)
