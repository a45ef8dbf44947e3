"""A stored policy as an MLflow model: `mlflow.pyfunc` loads it through this module, and nothing is unpickled.

Save one with `mlflow.pyfunc.save_model(path, loader_module=serving.__name__, data_path=policy_folder)`.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import torch

from plancurate.errors import PlancurateError
from plancurate.tasks.learning.observations import width
from plancurate.tasks.learning.policies.acting import ActingStack, shown
from plancurate.tasks.learning.policies.trained import TrainedPolicy, load_policy


class ServedPolicy:
    """Observations in, next joint angles out.

    A row holds the observation (o) that the policy was trained on; behind it the joint angles (n), unless they are
    one of its terms. Rows (b, inputs), as an array or a data frame, are those of the successive steps of one
    rollout; windows (b, w, inputs) are the latest rows of b rollouts, of which the last one is answered. Either
    gives next joint angles (b, n). The memory of a recurrent policy begins at zero with each call and after every
    `window` steps.
    """

    def __init__(self, trained: TrainedPolicy) -> None:
        self.trained = trained
        self.observed = width(trained.layout)
        self.joints = joint_columns(trained)
        self.inputs = max(self.observed, self.joints.stop)

    def predict(self, model_input: Any, params: Mapping[str, Any] | None = None) -> npt.NDArray[np.float64]:
        """Next joint angles (b, n); raises PlancurateError for input of another shape."""
        rows = np.array(model_input, dtype=np.float64)
        if rows.ndim not in (2, 3) or rows.shape[-1] != self.inputs:
            behind = "" if self.inputs == self.observed else f" and joint angles ({self.trained.dof})"
            raise PlancurateError(
                f"model input: shape {rows.shape}; rows of {self.inputs} numbers are right, or windows "
                f"(b, w, {self.inputs}): {shown(self.trained.layout)}{behind}"
            )
        rollouts = torch.from_numpy(rows[None] if rows.ndim == 2 else rows)
        stack = ActingStack([self.trained])
        following = [
            stack.next_q(step[None, :, : self.observed], step[None, :, self.joints])[0]
            for step in rollouts.unbind(1)
        ]
        return np.asarray(torch.stack(following)[:, 0].numpy() if rows.ndim == 2 else following[-1].numpy())


def joint_columns(trained: TrainedPolicy) -> slice:
    """Columns of a row that hold the joint angles: those of the term, or else the ones behind the observation."""
    begin = 0
    for name, size in trained.layout:
        if name == "joint_positions":
            break
        begin += size
    return slice(begin, begin + trained.dof)


def _load_pyfunc(path: str) -> ServedPolicy:
    """Load the policy folder at `path`; MLflow calls this."""
    return ServedPolicy(load_policy(Path(path)))
