"""What a study is made of: one typed configuration for the command line, the presets and Prefect's forms."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    BeforeValidator,
    Field,
    ValidationError,
    field_validator,
    model_validator,
)

from plancurate import native
from plancurate.bounds import Seed, Settings
from plancurate.errors import PlancurateError, UnknownNameError, field_of, first_problem
from plancurate.offers import offers
from plancurate.robots import DEFAULT_ROBOT, DEFAULT_SCENE, robot_names, scene_names
from plancurate.tasks.candidates.settings import GenerateSettings
from plancurate.tasks.candidates.sources import source_names
from plancurate.tasks.curation.selector_choice import SelectorChoice
from plancurate.tasks.learning.settings import (
    CorrectionSettings,
    EvaluateSettings,
    TrainSettings,
    registered_terms,
)
from plancurate.yaml_files import merged, read_mapping

PRESETS = Path(__file__).parent / "presets"
# Further selectors take their time; the preset `paper` has them all.
BASIC_SELECTORS = (
    "General", "Random", "RuleBased_General", "KMeans", "DBSCAN", "Hierarchical",
    "KMeans_Hybrid", "DBSCAN_Hybrid", "Hierarchical_Hybrid",
)  # fmt: skip
POLICIES = ("BC_MLP", "BC_RNN", "BC_RNN_Dropout", "BC_RNN_MDN")
MOST_TARGETS = 1_000_000
GrowBy = Literal["targets", "runs"]
"""What a study grows by: training targets, or runs of each planner to a target."""
Choice = Annotated[SelectorChoice, BeforeValidator(SelectorChoice.read)]


def registered_policies() -> list[str]:
    """Return the names of all policies."""
    from plancurate.tasks.learning.policies import policy_names  # torch: no --help needs it

    return policy_names()


class StudyConfig(Settings):
    """A whole study: candidates, selections, policies, tests. Every stage reads its part."""

    name: str = Field(
        "quick",
        pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$",
        max_length=100,  # a folder of the lake
        description="Name of the study.",
    )
    robot: str = Field(
        DEFAULT_ROBOT,
        description="A registered robot, or a folder with robot.yaml and a URDF.",
        json_schema_extra=offers(robot_names, "Folder"),
    )
    scenes: tuple[str, ...] = Field(
        (DEFAULT_SCENE,),
        min_length=1,
        description="Registered scenes, or YAML files; one table goes across them. clutter:0..511 are scenes that "
        "vary: training targets go round them, and fresh targets lie in others.",
        json_schema_extra=offers(scene_names, "File, clutter:SEED, or clutter:FIRST..LAST"),
    )
    n_targets: int = Field(5, ge=1, le=MOST_TARGETS, description="Training targets in each pool.")
    planners: tuple[str, ...] = Field(
        tuple(planner.name for planner in native.planners()),  # not a factory: Prefect's form shows the value
        min_length=1,
        description="OMPL planners by their class names, or other registered trajectory sources.",
        json_schema_extra=offers(source_names),
    )
    candidates: GenerateSettings = Field(
        default_factory=GenerateSettings, description="Targets, planning, timing and playback."
    )
    pools: dict[Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")], dict[str, Any]] = Field(
        default={},
        description="Variants of `candidates` by name, each with the fields that differ, such as "
        '{"raw": {"plan": {"simplification": "off"}}}; each is a pool of its own in every scene. '
        "Empty: `candidates` as it is.",
    )
    selectors: tuple[Choice, ...] = Field(
        tuple(SelectorChoice.model_construct(name=name) for name in BASIC_SELECTORS),
        min_length=1,
        description="Selectors to compare, by name or with parameters: "
        '{"name": "BehaviorRetrieval", "task": "shortest"}.',
    )
    budgets: tuple[int, ...] = Field((20,), min_length=1, description="Trajectories kept for each target.")
    selection_seeds: tuple[Seed, ...] = Field(
        (0,), min_length=1, description="Seeds of the selectors that draw at random."
    )
    policies: tuple[str, ...] = Field(
        POLICIES,
        min_length=1,
        description="Policies to train.",
        json_schema_extra=offers(registered_policies),
    )
    one_policy_a: Literal["selection", "cluster"] = Field(
        "selection",
        description="What a policy learns from: all that a selection keeps, or one cluster of it alone; each test is "
        "then left to the policy of the nearest cluster.",
    )
    seeds: tuple[Seed, ...] = Field((0,), min_length=1, description="Training seeds.")
    training: TrainSettings = Field(TrainSettings(), description="Networks and optimisation.")
    corrections: CorrectionSettings = Field(
        CorrectionSettings(), description="Rounds of corrections on training targets; needs arc steps."
    )
    evaluation: EvaluateSettings = Field(EvaluateSettings(), description="Tests and rollouts.")
    varying_observation: tuple[str, ...] = Field(
        ("goal_offset", "clearances_around", "clearances_ahead", "clearances_by_detours"),
        min_length=1,
        description="What policies observe where scenes vary, as in clutter:0..511, instead of training.observation.",
        json_schema_extra=offers(registered_terms),
    )
    unseen: int = Field(
        0,
        ge=0,
        le=1_000_000,
        description="Tests at fresh targets anywhere in the region; where scenes vary, each in a scene of its own that "
        "no policy was trained in.",
    )
    displaced_targets: int | None = Field(
        None,
        ge=0,
        le=MOST_TARGETS,
        description="Training targets, the first ones, around which displaced tests lie; null: all of them.",
    )
    verified_tests: int = Field(
        0,
        ge=0,
        le=1_000_000,
        description="Tests of each network, unseen ones first, whose rollouts, where they reach the target, are timed "
        "and verified as motions.",
    )
    workers: int = Field(2, ge=1, le=1024, description="Task runs in flight at once.")
    targets_per_task: int = Field(
        1, ge=1, le=1_000_000, description="Targets in one planning task; more for thousands."
    )
    runner: Literal["threads", "processes", "dask", "ray"] = Field(
        "threads",
        description="Where task runs work: threads, processes, a Dask or Ray cluster (extras `dask`, `ray`).",
    )
    dask_scheduler: str | None = Field(
        None,
        description="Address of a running Dask scheduler; a local cluster of `workers` processes without.",
    )
    ray_address: str | None = Field(
        None, description="Address of a running Ray cluster; a local one of `workers` processes without."
    )

    @field_validator("scenes", "planners", "policies", "budgets", "seeds", "selection_seeds")
    @classmethod
    def _no_repeats(cls, values: tuple[Any, ...]) -> tuple[Any, ...]:
        if len(set(values)) != len(values):
            raise ValueError("names a value twice")
        return values

    @field_validator("selectors")
    @classmethod
    def _one_of_each(cls, choices: tuple[SelectorChoice, ...]) -> tuple[SelectorChoice, ...]:
        if len({choice.label for choice in choices}) != len(choices):
            raise ValueError("names a selector twice with the same parameters")
        return choices

    @model_validator(mode="after")
    def _variants_are_settings(self) -> StudyConfig:
        for label in self.pools:
            self.pool_settings(label)
        return self

    @model_validator(mode="after")
    def _corrections_fit(self) -> StudyConfig:
        steps = self.training.demonstration_steps
        if self.corrections.rounds and steps != "arc":
            raise PlancurateError(
                f"corrections.rounds = {self.corrections.rounds}: corrections begin at rest on the way, which only arc "
                f"steps allow; training.demonstration_steps is '{steps}', it must be 'arc'"
            )
        return self

    @model_validator(mode="after")
    def _clusters_fit(self) -> StudyConfig:
        others = {"corrections.rounds": self.corrections.rounds, "verified_tests": self.verified_tests}
        for name, value in others.items():
            if self.one_policy_a == "cluster" and value:
                raise PlancurateError(f"{name} = {value}: with one_policy_a = cluster it must be 0")
        return self

    @field_validator("budgets")
    @classmethod
    def _positive(cls, budgets: tuple[int, ...]) -> tuple[int, ...]:
        if min(budgets) < 1:
            raise ValueError("a budget is at least 1 trajectory a target")
        return budgets

    @field_validator("planners")
    @classmethod
    def _known_planners(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        return known("planner", names, source_names())

    @field_validator("policies")
    @classmethod
    def _known_policies(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        return known("policy", names, registered_policies())

    @property
    def pool_labels(self) -> tuple[str, ...]:
        """Names of the variants of `candidates`; a single empty one where there are none."""
        return tuple(self.pools) or ("",)

    def pool_settings(self, label: str) -> GenerateSettings:
        """Return the candidates' settings of one variant; PlancurateError where they are wrong."""
        values = merged(self.candidates.model_dump(mode="json"), self.pools.get(label, {}))
        try:
            return GenerateSettings.model_validate(values)
        except ValidationError as error:
            raise PlancurateError(
                first_problem(f"pools.{label}.{field_of(error)}", error, GenerateSettings)
            ) from None


def known(kind: str, names: tuple[str, ...], valid: list[str]) -> tuple[str, ...]:
    """Return the names, or raise UnknownNameError for the first that is not valid."""
    for name in names:
        if name not in valid:
            raise UnknownNameError(kind, name, valid)
    return names


def preset_names() -> list[str]:
    """Return the names of the presets."""
    return sorted(path.stem for path in PRESETS.glob("*.yaml"))


def preset_values(name: str) -> dict[str, Any]:
    """Return the fields that a preset sets; UnknownNameError for a name that is none."""
    if name not in preset_names():
        raise UnknownNameError("preset", name, preset_names())
    return read_mapping(PRESETS / f"{name}.yaml")


def load_config(preset: str, file: Path | None, options: dict[str, Any]) -> StudyConfig:
    """Build a configuration from a preset, then a YAML file, then single fields, each over the one before.

    `options` holds the fields given on the command line. Raises PlancurateError naming the field, its value and
    what would be right.
    """
    written = read_mapping(file) if file else {}
    values = merged(merged(preset_values(preset), written), options)
    try:
        return StudyConfig.model_validate(values)
    except ValidationError as error:
        field = field_of(error)
        source = option_of(field) if holds(options, field) else f"{file or preset}: {field}"
        raise PlancurateError(first_problem(source, error, StudyConfig)) from None


def option_of(field: str) -> str:
    """Return the option that gives a dotted field, or the list that it is an item of."""
    return "--" + ".".join(part.replace("_", "-") for part in field.split(".") if not part.isdigit())


def holds(values: dict[str, Any], field: str) -> bool:
    """Say whether a dotted field, or something of it, is among the values."""
    head, _, rest = field.partition(".")
    inner = values.get(head)
    return holds(inner, rest) if rest and isinstance(inner, dict) else head in values
