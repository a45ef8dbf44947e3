"""What MLflow is told of a study and of each of its networks, and the tags that say what belongs to what."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from plancurate.tasks.curation.names import label

if TYPE_CHECKING:
    from plancurate.tasks.motion.served import ServedWorld

PARENT = "mlflow.parentRunId"
STUDY = "plancurate.study"  # the same identifier as in the lake
EVALUATION = "plancurate.evaluation_id"
SELECTION = "plancurate.selection"  # of the run above a selection's networks: its title


@dataclass(frozen=True)
class StudyRun:
    """A parent run; `logged` holds the evaluation ids that have a finished child already."""

    uri: str
    experiment_id: str
    run_id: str
    study: str
    logged: frozenset[str]
    selections: Mapping[str, str]
    """Run ids of the study's selections by their titles: each lies below the parent run and above its networks."""


@dataclass(frozen=True)
class ChildRun:
    """What one policy, trained on one selection with one seed, gave."""

    evaluation_id: str
    study_name: str
    selection_title: str
    """Of the run above this one."""
    selector: str
    budget: int | None
    policy: str
    seed: int
    params: Mapping[str, object]
    metrics: Mapping[str, float]
    loss_curve: Sequence[tuple[int, float]]
    pool_hash: str
    selection_id: str
    n_kept: int
    model_folder: Path
    world: ServedWorld
    """Where the served model makes motions."""
    example: tuple[float, float, float]
    """A target to ask the served model for, m."""
    tags: Mapping[str, str]

    @property
    def selection(self) -> str:
        """The selection's name: selector and budget."""
        return label(self.selector, self.budget)

    @property
    def name(self) -> str:
        """The run's name, such as `KMeans_Hybrid k=20 BC_RNN seed 0`."""
        return f"{self.selection} {self.policy} seed {self.seed}"

    @property
    def model_name(self) -> str:
        """The model's name, such as `quick-KMeans_Hybrid-k20-BC_RNN`."""
        budget = "all" if self.budget is None else f"k{self.budget}"
        return model_name(self.study_name, self.selector, budget, self.policy)


def model_name(*parts: str) -> str:
    """Join what a model is called by, without the characters that MLflow refuses in its name."""
    return re.sub(r"[/:.%\"']", "_", "-".join(parts))
