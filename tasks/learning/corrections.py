"""Corrections: the way to a training target from states that a trained policy itself came to.

Demonstrations begin at home, so a policy that has left their way has never seen how to get back. Rolled out on its
training targets it shows where it gets to; from there a planner shows how to go on to the goal configuration that the
demonstrations to that target end at. Test targets have no part in it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from plancurate import native
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.tasks.candidates.goals import planning_scene
from plancurate.tasks.candidates.plan import seed_of
from plancurate.tasks.candidates.polylines import path_length, travelled
from plancurate.tasks.candidates.relaxed import relaxed
from plancurate.tasks.candidates.settings import PlanSettings
from plancurate.tasks.candidates.sources.ompl import run_planner
from plancurate.tasks.learning.policies.trained import TrainedPolicy
from plancurate.tasks.learning.rollouts import moves
from plancurate.tasks.learning.settings import CorrectionSettings, EvaluateSettings
from plancurate.tasks.learning.training_goals import TrainingGoals

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

REVISION = 1
"""Raise it when corrections come out otherwise than before: the ids of corrected networks hold it."""
PLANNER = "RRTConnect"
UNSETTLED = "unsettled"
"""Failure of a rollout that reached its target and did not stay there."""


@dataclass(frozen=True, eq=False)
class Correction:
    """A path from a visited state to a training target's goal configuration."""

    target: int
    """Row of the training goals."""
    step: int
    """Moves after which the rollout was in the state."""
    failure: str
    """Why the rollout failed: collided, limits, lost or unsettled; "" for one that didn't."""
    path: FloatArray
    """Waypoints (w, n), rad, from the state to the goal, joined by straight lines."""


@dataclass(frozen=True, eq=False)
class Rollouts:
    """What one policy did on its way to t training targets."""

    q: FloatArray
    """(moves + 1, t, n): states, the robot's home first; one that was stopped stays where it was."""
    failure: npt.NDArray[np.object_]
    """(t,): as in `Correction`."""


def corrections(
    policy: TrainedPolicy,
    robot: Robot,
    scene: Scene,
    training: TrainingGoals,
    planning: PlanSettings,
    evaluation: EvaluateSettings,
    settings: CorrectionSettings,
    dt: float,
) -> list[Correction]:
    """Roll a policy out to its training targets and plan on from states that it visits.

    `planning` holds the seed, the clearance and the budget of the plans; where a state or goal is nearer to an
    obstacle than the clearance, it is planned from without. A state without a plan gives no correction. The same
    arguments give the same corrections.
    """
    went = rolled(policy, robot, scene, training, evaluation, dt)
    grown = planning_scene(scene, planning)
    found = []
    for target, goal in enumerate(training.configurations):
        failure = str(went.failure[target])
        count = settings.states_a_failure if failure else settings.states_a_success
        for step in chosen_steps(went.q[:, target], count, whole=bool(failure)):
            path = shortest(
                robot, (grown, scene), went.q[step, target], goal, planning, (target, step), settings.plans
            )
            if path is not None:
                found.append(Correction(target, int(step), failure, path))
    return found


def rolled(
    policy: TrainedPolicy,
    robot: Robot,
    scene: Scene,
    training: TrainingGoals,
    evaluation: EvaluateSettings,
    dt: float,
) -> Rollouts:
    """What a policy does on its way to its training targets, with the goals that it was shown there."""
    goals = None if policy.goals is None else training.configurations
    states = []
    for trials in moves([policy], robot, scene, training.positions, evaluation, dt, goals):
        states.append(trials.state.q)
    settled = (trials.distance() < evaluation.reach_m) & ~trials.stopped
    return Rollouts(np.stack(states), np.where(trials.reached & ~settled, UNSETTLED, trials.failure()))


def chosen_steps(q: FloatArray, count: int, *, whole: bool) -> IntArray:
    """Steps of a rollout q (m, n) at `count` equal parts of its length, never its first; `whole`: its end is one.

    Fewer where it hardly moved, so that several parts end in one step.
    """
    along = travelled(q)
    shares = np.arange(1, count + 1) / (count if whole else count + 1)
    steps = np.searchsorted(along, shares * along[-1])
    return np.unique(steps[along[steps] > 0])


def shortest(
    robot: Robot,
    scenes: Sequence[Scene],
    start: FloatArray,
    goal: FloatArray,
    planning: PlanSettings,
    number: tuple[int, int],
    plans: int,
) -> FloatArray | None:
    """The shortest of several plans (w, n) from start (n,) to goal (n,), in the first scene that has one; else None.

    Relaxed where the pool's paths are; what costs are then distances in the last of the scenes, the real one.
    """
    for kept in scenes:
        if paths := list(planned(robot, kept, start, goal, planning, number, plans)):
            path = min(paths, key=path_length)
            if planning.simplification != "relaxed":
                return path
            return relaxed(robot, scenes[-1], kept, path, planning.resolution)
    return None


def planned(
    robot: Robot,
    scene: Scene,
    start: FloatArray,
    goal: FloatArray,
    planning: PlanSettings,
    number: tuple[int, int],
    plans: int,
) -> Iterator[FloatArray]:
    """Paths that plans with different seeds find; none where the start or goal is not free."""
    if not native.is_free(robot.native, scene.native, np.stack([start, goal])).all():
        return
    target, step = number
    simplified = planning.model_copy(update={"simplification": "full"})
    for run in range(plans):
        seed = seed_of(planning.seed, target, f"correction {step}", run)
        result = run_planner(PLANNER, robot, scene, start, goal[None], simplified, seed)
        if result.status == "exact":
            yield result.path
