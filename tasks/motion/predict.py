"""Motion prediction: a target in, a verified motion out, the policy's own or else the planner's."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import product
from typing import Any, Literal

import numpy as np
from pydantic import Field

from plancurate import native
from plancurate.bounds import Seed, Settings
from plancurate.errors import PlancurateError
from plancurate.robots import Robot, Scene
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.candidates.goals import target_goals
from plancurate.tasks.candidates.payload import Payload
from plancurate.tasks.candidates.plan import plan_candidate
from plancurate.tasks.candidates.settings import GenerateSettings
from plancurate.tasks.candidates.targets import Target
from plancurate.tasks.learning.policies import TrainedPolicy
from plancurate.tasks.learning.reach import PLANNER
from plancurate.tasks.learning.settings import EvaluateSettings
from plancurate.tasks.motion.motion import Motion
from plancurate.tasks.motion.rollout import goals_of, policy_paths, proposals
from plancurate.tasks.motion.settings import MotionSettings
from plancurate.tasks.motion.timed import timed_motion
from plancurate.tasks.motion.verify import verify_motion
from plancurate.tasks.motion.violations import Verdict

Maker = Literal["policy", "planner", "nobody"]
STAGES = ("goals", "rollout", "timing", "verification", "planning")


class PredictSettings(Settings):
    """How motions are made and judged."""

    candidates: GenerateSettings = Field(
        default_factory=GenerateSettings,
        description="Tolerance of targets, planning and timing, as in a pool.",
    )
    rollout: EvaluateSettings = Field(
        EvaluateSettings(), description="Steps of a rollout, how near is reached."
    )
    verify: MotionSettings = Field(default_factory=MotionSettings, description="The verifier's settings.")
    proposals: int = Field(4, ge=1, le=100, description="Motions that a mixture policy may propose.")
    planner: str = Field(PLANNER, description="Who plans where no proposal passes.")
    seed: Seed = Field(0, description="Seed of goals, drawn proposals and plans.")


@dataclass
class Prediction:
    """What became of one target."""

    target: tuple[float, float, float]
    made_by: Maker = "nobody"
    motion: Motion | None = None
    verdict: Verdict | None = None
    distance_m: float | None = None
    """Of the tool from the target at the end of the motion."""
    refused: list[str] = field(default_factory=list)
    """Why earlier attempts were not taken, the policy's first."""
    seconds: dict[str, float] = field(default_factory=lambda: dict.fromkeys(STAGES, 0.0))
    """Wall time of each stage, s; the share of a rollout of many targets at once."""

    def as_record(self) -> dict[str, Any]:
        """Everything but the motion's samples as plain data."""
        return {
            "target": list(self.target),
            "made_by": self.made_by,
            "distance_m": self.distance_m,
            "duration_s": None if self.motion is None else float(self.motion.times[-1]),
            "verdict": None if self.verdict is None else self.verdict.as_record(),
            "refused": self.refused,
            "seconds": self.seconds,
        }


@dataclass(frozen=True)
class Predictor:
    """Robot, scene and settings of predictions."""

    robot: Robot
    scene: Scene
    settings: PredictSettings
    payload: Payload | None = None

    def policy_attempt(self, policy: TrainedPolicy, number: int, waiting: list[Prediction]) -> None:
        """Give those still waiting the motion of the policy's proposal of that number where it passes."""
        positions = np.array([prediction.target for prediction in waiting])
        settings, share = self.settings, 1 / len(waiting)
        spent = dict.fromkeys(STAGES, 0.0)
        rollout = settings.rollout.model_copy(update={"seed": settings.seed + number})
        with timed(spent, "goals"):
            targets = settings.candidates.targets
            goals = goals_of(policy, self.robot, self.scene, positions, targets, settings.seed)
        with timed(spent, "rollout"):
            dt = settings.candidates.timing.dt
            paths = policy_paths(policy, self.robot, self.scene, positions, rollout, dt, goals)
        for prediction, found in zip(waiting, paths, strict=True):
            for stage, seconds in spent.items():
                prediction.seconds[stage] += share * seconds
            if found.reason:
                prediction.refused.append(f"policy: {found.reason}")
            else:
                self.judge(prediction, found.path, "policy")

    def planner_attempt(self, number: int, prediction: Prediction) -> None:
        """Plan to a target, run after run, until a motion passes; at last without the clearance that plans keep."""
        settings, position = self.settings.candidates, np.array(prediction.target)
        rng = np.random.default_rng((self.settings.seed, number))
        with timed(prediction.seconds, "planning"):
            goals = target_goals(self.robot, self.scene, position, settings.targets, rng)
        if not len(goals):
            prediction.refused.append(
                "planner: no free joint position reaches the target within its orientation tolerance"
            )
            return
        target = Target(number, position, goals)
        near = settings.model_copy(update={"plan": settings.plan.model_copy(update={"clearance_m": 0.0})})
        tried = [settings] if settings.plan.clearance_m == 0 else [settings, near]
        for kept, run in product(tried, range(settings.plan.runs)):
            with timed(prediction.seconds, "planning"):
                planned = plan_candidate(self.robot, self.scene, target, self.settings.planner, run, kept)
            if planned.status != "exact":
                prediction.refused.append(f"planner: {planned.reason}")
            elif self.judge(prediction, planned.path, "planner"):
                return

    def judge(self, prediction: Prediction, path: FloatArray, maker: Maker) -> bool:
        """Time and verify a path (w, n), and take it where it passes; says whether it did."""
        try:
            with timed(prediction.seconds, "timing"):
                motion = timed_motion(self.robot, self.scene, path, self.settings.candidates.timing)
        except PlancurateError as error:
            prediction.refused.append(f"{maker}: {error}")
            return False
        with timed(prediction.seconds, "verification"):
            verdict = verify_motion(self.robot, self.scene, motion, self.settings.verify, self.payload)
        if verdict.first is not None:
            prediction.refused.append(f"{maker}: {verdict.first.sentence}")
            return False
        tool = native.fk(self.robot.native, motion.positions[-1:])[0, :3, 3]
        prediction.made_by, prediction.motion, prediction.verdict = maker, motion, verdict
        prediction.distance_m = float(np.linalg.norm(tool - np.array(prediction.target)))
        return True


def predict_motions(
    policy: TrainedPolicy | None,
    robot: Robot,
    scene: Scene,
    targets: FloatArray,
    settings: PredictSettings = PredictSettings(),
    payload: Payload | None = None,
) -> list[Prediction]:
    """A verified motion from the robot's home to each target (t, 3), m, where there is one.

    The policy's proposals come first, all targets at once; the planner makes what none of them makes, or everything
    without a policy. The same arguments give the same motions. PlancurateError for targets that are no numbers, for
    another robot's policy, or for an unknown planner.
    """
    if targets.ndim != 2 or targets.shape[1] != 3 or not np.isfinite(targets).all():
        raise PlancurateError(
            f"targets: shape {targets.shape}; rows of x, y and z in m, all finite, would be right"
        )
    predictor = Predictor(robot, scene, settings, payload or settings.candidates.verify.payload)
    predictions = [Prediction((float(x), float(y), float(z))) for x, y, z in targets]
    offered = [] if policy is None else proposals(policy, settings.proposals)
    for number, proposal in enumerate(offered):
        if waiting := [prediction for prediction in predictions if prediction.made_by == "nobody"]:
            predictor.policy_attempt(proposal, number, waiting)
    for number, prediction in enumerate(predictions):
        if prediction.made_by == "nobody":
            predictor.planner_attempt(number, prediction)
    return predictions


@contextmanager
def timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    """Add the wall time of the block to a stage."""
    start = time.perf_counter()
    try:
        yield
    finally:
        seconds[stage] += time.perf_counter() - start
