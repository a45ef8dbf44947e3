"""What decides the candidates of a pool. Apart from what plans and simulates, which takes a second to import."""

from __future__ import annotations

from pydantic import Field, field_validator

from plancurate import native
from plancurate.bounds import Settings
from plancurate.errors import UnknownNameError


class TargetSettings(Settings):
    """Where targets lie. One nearer to the start than `min_distance_m` could be reached by standing still."""

    range_m: float = Field(default=0.5, gt=0, description="edge of the cube around the home tool position, m")
    min_distance_m: float = Field(
        default=0.1, ge=0, description="least distance to the home tool position, m"
    )
    seed: int = Field(default=0, ge=0, description="another seed gives other targets")
    max_tries: int = Field(default=200, gt=0, description="positions drawn for a target before giving up")


class PlanSettings(Settings):
    """How much each planner may work; counts end a run, so that a busy machine plans the same paths."""

    runs: int = Field(default=3, gt=0, description="runs of each planner for each target")
    seed: int = Field(default=0, ge=0, description="another seed gives other paths")
    state_checks: int = Field(
        default=100_000, gt=0, description="collision checks of states after which a run ends"
    )
    polls: int = Field(
        default=20_000, gt=0, description="questions whether to go on, ditto: some never check"
    )
    seconds: float = Field(
        default=30, gt=0, description="safety net, s; runs that it ends depend on the machine"
    )
    resolution: float = Field(
        default=0.01, gt=0, description="joint step of collision checks along edges, rad"
    )
    simplify: bool = Field(default=True, description="shorten and smooth solutions")
    params: dict[str, dict[str, str]] = Field(
        default={}, description="a planner's parameters by OMPL's names"
    )

    @field_validator("params")
    @classmethod
    def _known(cls, params: dict[str, dict[str, str]]) -> dict[str, dict[str, str]]:
        infos = {info.name: info for info in native.planners()}
        for planner, names in params.items():
            if planner not in infos:
                raise UnknownNameError("planner", planner, infos)
            for name in names:
                if name not in infos[planner].params:
                    raise UnknownNameError(f"parameter of planner {planner}", name, infos[planner].params)
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


class GenerateSettings(Settings):
    """Everything but robot and scene that decides what candidates a pool holds."""

    targets: TargetSettings = Field(default_factory=TargetSettings)
    plan: PlanSettings = Field(default_factory=PlanSettings)
    timing: TimingSettings = Field(default_factory=TimingSettings)
    verify: VerifySettings = Field(default_factory=VerifySettings)
