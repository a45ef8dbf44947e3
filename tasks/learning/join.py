"""Demonstrations of several scenes as one data set."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from plancurate.errors import PlancurateError
from plancurate.tasks.learning.demonstrations import Demonstrations
from plancurate.tasks.learning.training_goals import TrainingGoals


def join_demonstrations(parts: Sequence[Demonstrations]) -> Demonstrations:
    """All steps of several data sets, in their order; windows of one without weights are drawn with weight 1.

    Goals stand side by side, so a target that two scenes share has a goal of each. Raises PlancurateError where there
    is nothing to join, or where observations or robots differ.
    """
    _require_alike(parts)
    first = np.cumsum([0, *(len(part.observations) for part in parts[:-1])])
    goals = [part.goals for part in parts if part.goals is not None]
    weights = [
        np.ones(len(part.window_starts)) if part.window_weights is None else part.window_weights
        for part in parts
    ]
    return Demonstrations(
        layout=parts[0].layout,
        observations=np.concatenate([part.observations for part in parts]),
        q=np.concatenate([part.q for part in parts]),
        actions=np.concatenate([part.actions for part in parts]),
        starts=np.concatenate([part.starts + k for part, k in zip(parts, first, strict=True)]),
        lengths=np.concatenate([part.lengths for part in parts]),
        window_starts=np.concatenate([part.window_starts + k for part, k in zip(parts, first, strict=True)]),
        window_weights=None
        if all(part.window_weights is None for part in parts)
        else np.concatenate(weights),
        goals=None
        if not goals
        else TrainingGoals(
            np.concatenate([goal.positions for goal in goals]),
            np.concatenate([goal.configurations for goal in goals]),
        ),
    )


def _require_alike(parts: Sequence[Demonstrations]) -> None:
    if not parts:
        raise PlancurateError("demonstrations: there is no data set to join; at least one is needed")
    for part in parts[1:]:
        if (part.layout, part.dof) != (parts[0].layout, parts[0].dof):
            raise PlancurateError(
                f"demonstrations: data sets of {parts[0].layout} for {parts[0].dof} joints and of {part.layout} for "
                f"{part.dof} can't be joined; make all with the same terms and robot"
            )
