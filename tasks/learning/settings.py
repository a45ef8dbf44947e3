"""What a user may set of training and evaluation; it imports no networks, so that a command line starts fast."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field, field_validator

from plancurate.bounds import Seed, Settings
from plancurate.offers import offers

if TYPE_CHECKING:
    from plancurate.tasks.learning.policies.policy import Policy

Action = Literal["delta", "absolute"]
BASIC_OBSERVATION = ("target_offset", "joint_positions")
TESTS_BY_DISTANCE = {0: 1, 1: 3, 2: 3, 3: 3, 4: 3, 5: 3}
"""Tests of each training target by displacement in cm."""


def registered_terms() -> list[str]:
    """Return the names of all observation terms."""
    from plancurate.tasks.learning.observations import term_names

    return term_names()


class TrainSettings(Settings):
    """How every network is trained, whatever was selected for it."""

    steps: int = Field(
        2000, ge=1, description="gradient steps, the same for every selection; the last state counts"
    )
    learning_rate: float = Field(1e-3, gt=0, description="largest step size of Adam")
    schedule: Literal["cosine", "constant"] = Field("cosine", description="how the learning rate goes on")
    weight_decay: float = Field(
        0.0,
        ge=0,
        description="pull of all weights to zero in each step, as a share of them and of the learning rate",
    )
    clip: float = Field(1.0, gt=0, description="largest norm of a network's gradient")
    window: int = Field(
        10,
        ge=1,
        description="steps a recurrent policy is trained on; in a rollout its memory is reset so often",
    )
    observation: tuple[str, ...] = Field(
        BASIC_OBSERVATION,
        min_length=1,
        description="observation terms, in the order in which a policy sees them",
        json_schema_extra=offers(registered_terms),
    )
    demonstration_steps: Literal["time", "arc"] = Field(
        "time",
        description="steps of a demonstration: as sampled in time, or at equal joint steps, whatever the speed",
    )
    arc_rad: float = Field(
        0.06,  # 1.2 rad/s over a time step of 0.05 s
        gt=0,
        allow_inf_nan=False,
        description="length of an arc step, Euclidean over all joints, rad",
    )
    action: Action = Field(
        "delta", description="next joint angles as a difference to the present ones, or as they are"
    )
    size: Literal["small", "robomimic"] = Field(
        "small", description="small and fast networks, or the sizes of robomimic's experiments"
    )
    policies: dict[str, dict[str, Any]] = Field(
        default={}, description='settings of single policies, e.g. {"BC_RNN_Dropout": {"dropout": 0.3}}'
    )
    device: str = Field("cpu", description="where the networks are trained: cpu or cuda")

    @field_validator("observation")
    @classmethod
    def _terms_are_known(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        from plancurate.tasks.learning.observations import require_terms

        require_terms(names)
        return names

    @field_validator("policies")
    @classmethod
    def _policies_are_known(cls, policies: dict[str, dict[str, Any]]) -> dict[str, dict[str, Any]]:
        if not policies:
            return policies
        from plancurate.tasks.learning.policies.policy import make_policy

        # As numbers, not as the text that a command line gives: a study's key must not depend on who wrote them.
        return {
            name: make_policy(name, values).model_dump(mode="json", include=set(values))
            for name, values in policies.items()
        }

    def policy(self, name: str) -> Policy:
        """Build the named policy in the size and with the settings asked for."""
        from plancurate.tasks.learning.policies.policy import kind_of, make_policy

        sizes = kind_of(name).robomimic if self.size == "robomimic" else {}
        return make_policy(name, {**sizes, **self.policies.get(name, {})})


class EvaluateSettings(Settings):
    """How a rollout is run and judged."""

    max_steps: int = Field(200, ge=1, description="steps after which a rollout ends")
    reach_m: float = Field(0.05, gt=0, description="a target is reached when the tool is nearer than this, m")
    precise_m: float = Field(
        0.01, gt=0, description="it is reached precisely when the tool ends nearer than this, m"
    )
    resolution: float = Field(
        0.05, gt=0, description="largest joint step between collision checks of a move, rad"
    )
    seed: Seed = Field(1000, description="seed of the displaced test targets")
    device: str = Field("cpu", description="where the networks run: cpu or cuda")


class CorrectionSettings(Settings):
    """How often, and from where, policies are shown the way from states that they came to themselves."""

    rounds: int = Field(
        0,
        ge=0,
        le=20,
        description="times that each network is rolled out on its training targets and corrected",
    )
    most_share: float = Field(
        0.5,
        gt=0,
        lt=1,
        description="greatest share of what a network learns from, in the mean over batches, that is corrections",
    )
    states_a_failure: int = Field(
        4, ge=1, description="states on the way of a failed rollout to plan from, the last one among them"
    )
    states_a_success: int = Field(
        1, ge=0, description="states on the way of a rollout that ends at its target, to plan from"
    )
    plans: int = Field(3, ge=1, description="plans from each state, the shortest of which is kept")
