"""Everything but robot and scene that decides what candidates a pool holds. Light: configurations import it."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, SerializerFunctionWrapHandler, field_validator, model_serializer

from plancurate.bounds import Finite, Settings
from plancurate.errors import UnknownNameError
from plancurate.tasks.candidates.payload import Payload
from plancurate.tasks.candidates.sources import find_source

Orientation = Literal["exact", "yaw_free", "cone", "any"]
Goals = Literal["all", "nearest", "pose", "consistent"]


class TargetSettings(Settings):
    """Where targets lie and how the tool may be turned there.

    A target nearer to the start than `min_distance_m` could be reached by standing still. Lengths that are left
    out are shares of the robot's reach.
    """

    regions: tuple[str, ...] = Field(
        default=(), description="the scene's regions to draw from; none: all it has, or else the cube"
    )
    range_m: float | None = Field(
        default=None,
        gt=0,
        description="edge of the cube around the start's tool position, m; null: 0.294 reach",
    )
    min_distance_m: float | None = Field(
        default=None, ge=0, description="least distance to the start's tool position, m; null: 0.059 reach"
    )
    orientation: Orientation = Field(
        default="yaw_free",
        description="the tool at a target: as at the start or as the scene says; turned about its own axis; that "
        "and tilted by up to cone_deg; any way",
    )
    cone_deg: float = Field(default=40.0, gt=0, le=180, description="greatest tilt of a cone, degrees")
    seed: int = Field(default=0, ge=0, description="another seed gives other targets")
    max_tries: int = Field(default=200, gt=0, description="positions drawn for a target before giving up")
    recorded: str = Field(
        default="", description="an imported set whose targets these are, by its id; empty: they are drawn"
    )

    @model_serializer(mode="wrap")
    def _recorded_if_any(self, plain: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Without a set nothing is said of one: pools from before there were any keep their ids."""
        values: dict[str, Any] = plain(self)
        if not self.recorded:
            values.pop("recorded", None)
        return values


class PlanSettings(Settings):
    """How much each planner may work; counts end a run, so that a busy machine plans the same paths."""

    runs: int = Field(default=3, gt=0, description="runs of each planner for each target")
    seed: int = Field(default=0, ge=0, description="another seed gives other paths")
    goals: Goals = Field(
        default="pose",
        description="a run's goal configurations: all of the target's; the one nearest to the start; its own draw "
        "within the target's tolerance; one that continues those of neighbouring targets",
    )
    goal_draws: int = Field(
        default=4,
        gt=0,
        description="goal configurations that a run draws, for goals=pose",
    )
    clearance_m: float = Field(
        default=0.0, ge=0, description="distance kept to obstacles beyond the scene's margin, m"
    )
    state_checks: int = Field(
        default=100_000, gt=0, description="collision checks of states after which a run ends"
    )
    polls: int = Field(
        default=20_000,
        gt=0,
        description="questions whether to go on after which a run ends; some planners check no states",
    )
    seconds: float = Field(
        default=30, gt=0, description="safety net, s; runs that it ends depend on the machine"
    )
    resolution: float = Field(
        default=0.01, gt=0, description="joint step of collision checks along edges, rad"
    )
    simplification: Literal["off", "partial", "full", "relaxed"] = Field(
        default="full",
        description="how far solutions are shortened: not at all, by a drawn number of shortcuts, all the way; "
        "relaxed: all the way, and then waypoints are moved until the path is short and off obstacles",
    )
    params: dict[str, dict[str, str]] = Field(
        default={}, description="a planner's parameters by OMPL's names"
    )

    @field_validator("params")
    @classmethod
    def _known(cls, params: dict[str, dict[str, str]]) -> dict[str, dict[str, str]]:
        for planner, names in params.items():
            known = find_source(planner).params
            for name in names:
                if name not in known:
                    raise UnknownNameError(f"parameter of planner {planner}", name, known)
        return params


class TimingSettings(Settings):
    """How a path becomes a trajectory."""

    dt: float = Field(default=0.05, gt=0, description="time between two stored samples, s")
    limit_share: float = Field(
        default=0.95, gt=0, lt=1, description="share of velocity and acceleration limits to use"
    )
    dense_spacing: float = Field(
        default=0.3, gt=0, description="distance between a dense spline's points, rad"
    )
    resolution: float = Field(
        default=0.01, gt=0, description="joint step of collision checks along edges, rad"
    )


class VerifySettings(Settings):
    """How a trajectory is played and what it must keep to."""

    frequency_hz: float = Field(default=240.0, ge=100.0, description="Physics and control steps a second.")
    position_gain: float = Field(
        default=0.3, gt=0.0, le=1.0, description="Share of the position error undone in a step."
    )
    velocity_gain: float = Field(
        default=1.0, gt=0.0, le=1.0, description="Share of the velocity error undone in a step."
    )
    hold_s: float = Field(default=0.25, ge=0.0, description="Seconds that the last waypoint is held.")
    max_tracking_error_rad: float = Field(
        default=0.02, gt=0.0, description="Largest joint error on the way, rad or m."
    )
    max_final_error_m: float = Field(
        default=0.01, gt=0.0, description="Tool's distance from its goal after holding, m."
    )
    max_saturated_share: float = Field(
        default=0.05, ge=0.0, le=1.0, description="Share of joints and steps at the effort limit."
    )
    payload_mass_kg: float = Field(
        default=0.0, ge=0.0, le=1e5, description="Mass that the tool carries, a point, kg; 0: none."
    )
    payload_centre_m: tuple[Finite, Finite, Finite] = Field(
        default=(0.0, 0.0, 0.0), description="Where that mass is in the tool's frame, m."
    )

    @property
    def payload(self) -> Payload | None:
        """What the tool carries; None where it carries nothing."""
        if not self.payload_mass_kg:
            return None
        return Payload(mass_kg=self.payload_mass_kg, centre_m=self.payload_centre_m)

    @model_serializer(mode="wrap")
    def _payload_if_any(self, plain: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Without a payload nothing is said of one: pools from before it could be set keep their ids."""
        values: dict[str, Any] = plain(self)
        if not self.payload_mass_kg:
            for name in ("payload_mass_kg", "payload_centre_m"):
                values.pop(name, None)
        return values


class GenerateSettings(Settings):
    """All of the above."""

    targets: TargetSettings = Field(default_factory=TargetSettings)
    plan: PlanSettings = Field(default_factory=PlanSettings)
    timing: TimingSettings = Field(default_factory=TimingSettings)
    verify: VerifySettings = Field(default_factory=VerifySettings)
