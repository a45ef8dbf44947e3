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
from plancurate.tasks.learning.policies.acting import ActingStack
from plancurate.tasks.learning.policies.trained import TrainedPolicy, load_policy


class ServedPolicy:
    """Observations in, next joint angles out.

    An observation is target minus tool position (3), m, then the joint angles (n), rad. Rows (b, 3 + n), as
    an array or a data frame, are the successive observations of one rollout; windows (b, w, 3 + n) are the
    latest observations of b rollouts, of which the last one is answered. Either gives next joint angles
    (b, n). The memory of a recurrent policy begins at zero with each call and after every `window` steps.
    """

    def __init__(self, trained: TrainedPolicy) -> None:
        self.trained = trained

    def predict(self, model_input: Any, params: Mapping[str, Any] | None = None) -> npt.NDArray[np.float64]:
        """Next joint angles (b, n); raises PlancurateError for input of another shape."""
        seen = np.array(model_input, dtype=np.float64)
        observed = 3 + self.trained.dof
        if seen.ndim not in (2, 3) or seen.shape[-1] != observed:
            raise PlancurateError(
                f"model input: shape {seen.shape}; rows of {observed} numbers are right, "
                f"or windows (b, w, {observed})"
            )
        rollouts = torch.from_numpy(seen[None] if seen.ndim == 2 else seen)
        stack = ActingStack([self.trained])
        answers = [stack.next_q(step[None])[0] for step in rollouts.unbind(1)]
        return np.asarray(torch.stack(answers)[:, 0].numpy() if seen.ndim == 2 else answers[-1].numpy())


def _load_pyfunc(path: str) -> ServedPolicy:
    """Load the policy folder at `path`; MLflow calls this."""
    return ServedPolicy(load_policy(Path(path)))
