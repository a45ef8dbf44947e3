"""What a study is made of: one typed configuration for the command line, the presets and Prefect's forms."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from plancurate import native
from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.tasks.candidates.generate import GenerateSettings
from plancurate.tasks.curation.selectors.base import selector_names
from plancurate.tasks.learning.policies import policy_names
from plancurate.tasks.learning.settings import EvaluateSettings, TrainSettings

PRESETS = Path(__file__).parent / "presets"
# Further selectors take their time; the preset `paper` has them all.
BASIC_SELECTORS = (
    "General", "Random", "RuleBased_General", "KMeans", "DBSCAN", "Hierarchical",
    "KMeans_Hybrid", "DBSCAN_Hybrid", "Hierarchical_Hybrid",
)  # fmt: skip
# These say how fast a study runs and what it is called, not what comes out.
UNIDENTIFYING = {"name", "workers", "targets_per_task"}


class StudyConfig(BaseModel):
    """A whole study: candidates, selections, policies, tests. Every stage reads its part."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str = Field("quick", pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", description="Name of the study.")
    robot: str = Field("h2017", description="A registered robot, or a folder with robot.yaml and a URDF.")
    scene: str = Field("free", description="A registered scene, or a YAML file.")
    n_targets: int = Field(5, ge=1, description="Training targets.")
    planners: tuple[str, ...] = Field(
        tuple(planner.name for planner in native.planners()),  # not a factory: Prefect's form shows the value
        min_length=1,
        description="OMPL planners by their class names.",
    )
    candidates: GenerateSettings = Field(
        default_factory=GenerateSettings, description="Targets, planning, timing and playback."
    )
    selectors: tuple[str, ...] = Field(BASIC_SELECTORS, min_length=1, description="Selectors to compare.")
    budgets: tuple[int, ...] = Field((20,), min_length=1, description="Trajectories kept for each target.")
    selector_seed: int = Field(0, ge=0, description="Seed of the selectors that draw at random.")
    policies: tuple[str, ...] = Field(tuple(policy_names()), min_length=1, description="Policies to train.")
    seeds: tuple[int, ...] = Field((0,), min_length=1, description="Training seeds.")
    training: TrainSettings = Field(TrainSettings(), description="Networks and optimisation.")
    evaluation: EvaluateSettings = Field(EvaluateSettings(), description="Tests and rollouts.")
    unseen: int = Field(0, ge=0, description="Tests at fresh targets anywhere in the cube.")
    workers: int = Field(2, ge=1, description="Planning tasks in flight at once.")
    targets_per_task: int = Field(1, ge=1, description="Targets in one planning task; more for thousands.")

    @field_validator("planners", "selectors", "policies", "budgets", "seeds")
    @classmethod
    def _no_repeats(cls, values: tuple[Any, ...]) -> tuple[Any, ...]:
        if len(set(values)) != len(values):
            raise ValueError("names a value twice")
        return values

    @field_validator("budgets")
    @classmethod
    def _positive(cls, budgets: tuple[int, ...]) -> tuple[int, ...]:
        if min(budgets) < 1:
            raise ValueError("a budget is at least 1 trajectory a target")
        return budgets

    @field_validator("planners")
    @classmethod
    def _known_planners(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        return known("planner", names, [planner.name for planner in native.planners()])

    @field_validator("selectors")
    @classmethod
    def _known_selectors(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        return known("selector", names, selector_names())

    @field_validator("policies")
    @classmethod
    def _known_policies(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        return known("policy", names, policy_names())

    @property
    def key(self) -> str:
        """Hash of everything that decides the results: two studies with the same key have the same numbers."""
        text = self.model_dump_json(exclude=UNIDENTIFYING)
        return hashlib.sha256(text.encode()).hexdigest()[:8]


def known(kind: str, names: tuple[str, ...], valid: list[str]) -> tuple[str, ...]:
    """Return the names, or raise UnknownNameError for the first that is not valid."""
    for name in names:
        if name not in valid:
            raise UnknownNameError(kind, name, valid)
    return names


def preset_names() -> list[str]:
    """Return the names of the presets."""
    return sorted(path.stem for path in PRESETS.glob("*.yaml"))


def load_config(preset: str, file: Path | None, overrides: dict[str, Any]) -> StudyConfig:
    """Build a configuration from a preset, then a YAML file, then single fields, each over the one before.

    Raises PlancurateError naming the field, its value and what would be right.
    """
    if preset not in preset_names():
        raise UnknownNameError("preset", preset, preset_names())
    values = read_yaml(PRESETS / f"{preset}.yaml")
    if file is not None:
        values = merged(values, read_yaml(file))
    values = merged(values, {name: value for name, value in overrides.items() if value is not None})
    try:
        return StudyConfig.model_validate(values)
    except ValidationError as error:
        raise PlancurateError(first_problem(file or preset, error)) from None


def read_yaml(file: Path) -> dict[str, Any]:
    """Read a YAML file that holds a mapping; raises PlancurateError if it is missing or holds anything else."""
    try:
        values = yaml.safe_load(file.read_text())
    except OSError as error:
        raise PlancurateError(f"{file}: {error.strerror}; give a readable YAML file") from None
    except yaml.YAMLError as error:
        raise PlancurateError(f"{file}: not YAML: {' '.join(str(error).split())}") from None
    if not isinstance(values, dict):
        raise PlancurateError(f"{file}: holds {type(values).__name__}, a mapping of fields would be right")
    return values


def merged(base: dict[str, Any], over: dict[str, Any]) -> dict[str, Any]:
    """Return base with over's values put in, mapping by mapping."""
    result = dict(base)
    for name, value in over.items():
        both = isinstance(value, dict) and isinstance(result.get(name), dict)
        result[name] = merged(result[name], value) if both else value
    return result


def first_problem(source: Path | str, error: ValidationError) -> str:
    """Say in one line what pydantic found first: source, field, value, what would be right."""
    problem = error.errors(include_url=False)[0]
    field = ".".join(str(part) for part in problem["loc"])
    return f"{source}: {field} = {problem['input']!r}: {problem['msg']}"
