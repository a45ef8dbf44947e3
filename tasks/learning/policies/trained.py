"""A trained network with everything a rollout needs, stored without code: safetensors and JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import torch
from pydantic import BaseModel, ConfigDict, ValidationError
from safetensors import SafetensorError
from safetensors.torch import load_file, save
from torch import Tensor

from plancurate.errors import PlancurateError, field_of, first_problem
from plancurate.tasks.lake.manifest import folder_damage, list_files
from plancurate.tasks.learning.observations import Layout, goal_terms, require_terms, width
from plancurate.tasks.learning.policies.policy import Policy, make_policy
from plancurate.tasks.learning.settings import Action
from plancurate.tasks.learning.training_goals import TrainingGoals

WEIGHTS_FILE, DESCRIPTION_FILE = "policy.safetensors", "policy.json"
GOALS = tuple(TrainingGoals.__dataclass_fields__)


@dataclass(frozen=True, eq=False)
class Normaliser:
    """Standardisation (value - mean) / scale of o observed and n acted numbers, tensors (o,) and (n,)."""

    observation_mean: Tensor
    observation_scale: Tensor
    action_mean: Tensor
    action_scale: Tensor


@dataclass(frozen=True, eq=False)
class TrainedPolicy:
    """One network's settings, parameters, standardisation, and how it was trained."""

    policy: Policy
    weights: Mapping[str, Tensor]
    normaliser: Normaliser
    layout: Layout
    """Observation terms that it was trained on, and how many numbers each gives."""
    action: Action
    """Whether the network gives the difference to the present joint angles or the next ones themselves."""
    window: int
    """Steps after which the hidden state begins again at zero, as it did in training."""
    seed: int
    train_s: float = 0.0
    """Its share of the stack's wall time: seconds divided by the networks trained together."""
    loss_curve: list[tuple[int, float]] = field(default_factory=list)
    """(gradient steps done, mean loss since the entry before)."""
    diagnostics: dict[str, float] = field(default_factory=dict)
    """What the policy tells of what it has learnt."""
    goals: TrainingGoals | None = None
    """Where its demonstrations end, if a term needs a goal: what goals of other positions are chosen by."""

    @property
    def dof(self) -> int:
        """Number of joints."""
        return len(self.normaliser.action_mean)

    def save(self, folder: Path) -> None:
        """Write policy.safetensors, policy.json and their manifest into the folder, which is made if missing."""
        folder.mkdir(parents=True, exist_ok=True)
        tensors = {f"weights.{name}": value.contiguous() for name, value in self.weights.items()}
        tensors |= {f"normaliser.{name}": value for name, value in vars(self.normaliser).items()}
        if self.goals is not None:
            tensors |= {f"goals.{name}": torch.from_numpy(value) for name, value in vars(self.goals).items()}
        (folder / WEIGHTS_FILE).write_bytes(save(tensors))
        description = Description(
            format=2,
            policy=self.policy.name,
            settings=self.policy.model_dump(mode="json"),
            observation=self.layout,
            action=self.action,
            window=self.window,
            seed=self.seed,
            train_s=self.train_s,
            loss_curve=self.loss_curve,
            diagnostics=self.diagnostics,
        )
        (folder / DESCRIPTION_FILE).write_text(description.model_dump_json(indent=1) + "\n")
        list_files(folder, (DESCRIPTION_FILE, WEIGHTS_FILE))


class Description(BaseModel):
    """What policy.json holds."""

    model_config = ConfigDict(extra="forbid", frozen=True, ser_json_inf_nan="constants")

    format: Literal[2]
    policy: str
    settings: dict[str, Any]
    observation: Layout
    """Terms and their sizes, in order."""
    action: Action
    window: int
    seed: int
    train_s: float
    loss_curve: list[tuple[int, float]]
    diagnostics: dict[str, float] = {}


def load_policy(folder: Path) -> TrainedPolicy:
    """Read a policy that `save` wrote; raises PlancurateError that names the file and what is wrong."""
    for name in (DESCRIPTION_FILE, WEIGHTS_FILE):
        if not (folder / name).is_file():
            raise PlancurateError(
                f"{folder / name}: no such file; a policy folder holds {DESCRIPTION_FILE} and {WEIGHTS_FILE}"
            )
    if damage := folder_damage(folder):
        raise PlancurateError(f"{damage[0]}; remove the folder and train again")
    try:
        description = Description.model_validate_json((folder / DESCRIPTION_FILE).read_text())
    except ValidationError as error:
        raise PlancurateError(
            first_problem(f"{folder / DESCRIPTION_FILE}: {field_of(error)}", error, Description)
        ) from None
    try:
        tensors = load_file(folder / WEIGHTS_FILE)
    except SafetensorError as error:
        raise PlancurateError(f"{folder / WEIGHTS_FILE}: not a safetensors file: {error}") from None
    try:
        require_terms([name for name, _ in description.observation])
        policy = make_policy(description.policy, description.settings)
    except PlancurateError as error:
        raise PlancurateError(f"{folder / DESCRIPTION_FILE}: {error}") from None
    return _restore(folder / WEIGHTS_FILE, description, policy, tensors)


def _restore(
    file: Path, description: Description, policy: Policy, tensors: dict[str, Tensor]
) -> TrainedPolicy:
    names = Normaliser.__dataclass_fields__
    missing = [f"normaliser.{name}" for name in names if f"normaliser.{name}" not in tensors]
    if missing:
        raise PlancurateError(f"{file}: tensor {missing[0]} is missing")
    normaliser = Normaliser(**{name: tensors[f"normaliser.{name}"] for name in names})
    weights = {name.removeprefix("weights."): t for name, t in tensors.items() if name.startswith("weights.")}
    observed, acted = len(normaliser.observation_mean), len(normaliser.action_mean)
    if observed != width(description.observation):
        raise PlancurateError(
            f"{file}: normaliser.observation_mean has {observed} numbers; "
            f"the observation terms in {DESCRIPTION_FILE} give {width(description.observation)}"
        )
    expected = policy.initial(observed, acted, torch.Generator())
    for name, value in expected.items():
        if name not in weights or weights[name].shape != value.shape:
            found = tuple(weights[name].shape) if name in weights else "missing"
            raise PlancurateError(
                f"{file}: weights.{name} is {found}; {policy.name} has {tuple(value.shape)}"
            )
    return TrainedPolicy(
        policy,
        {name: weights[name] for name in expected},
        normaliser,
        description.observation,
        description.action,
        description.window,
        description.seed,
        description.train_s,
        description.loss_curve,
        description.diagnostics,
        _goals(file, description, tensors, acted),
    )


def _goals(
    file: Path, description: Description, tensors: dict[str, Tensor], joints: int
) -> TrainingGoals | None:
    if not (needy := goal_terms([name for name, _ in description.observation])):
        return None
    positions, configurations = (tensors.get(f"goals.{name}", torch.empty(0)).numpy() for name in GOALS)
    if positions.shape[1:] != (3,) or configurations.shape != (len(positions), joints):
        raise PlancurateError(
            f"{file}: goals.positions is {positions.shape} and goals.configurations {configurations.shape}; the term "
            f"'{needy[0]}' needs (g, 3) and (g, {joints})"
        )
    return TrainingGoals(positions, configurations)
