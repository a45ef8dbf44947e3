"""What a policy needs to reach among obstacles that it was never shown: everything together, and each part left out.

    python experiments/clutter.py [--training 500] [--steps 5000] [--units 256] [--tests 40] [--rows ROW ...] [--json F]

Draws scenes of the family `clutter`, plans in each (the shortest of several runs of RRTConnect, relaxed), trains one
BC_MLP on all of them, or several whose mean is the policy, and rolls out in scenes that none was trained in: in all,
and to the hard targets, whose straight joint line is not free. The goal of a target continues those of a reference,
targets in the family's regions without obstacles, so that it depends on the scene only where that goal is not free.
Nothing is planned at a test.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from functools import cache, partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import torch
from mean_policy import mean_policy

from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.robots import Robot, Scene, load_robot, load_scene
from plancurate.robots.scene import native_scene
from plancurate.tasks.candidates.consistent_goals import draw_targets
from plancurate.tasks.candidates.continued_goals import agreeing_goals
from plancurate.tasks.candidates.goals import nearest_goal, planning_scene
from plancurate.tasks.candidates.plan import plan_candidate
from plancurate.tasks.candidates.polylines import path_length
from plancurate.tasks.candidates.relaxed import relaxed
from plancurate.tasks.candidates.scene_report import is_hard
from plancurate.tasks.candidates.settings import GenerateSettings
from plancurate.tasks.candidates.targets import Target, draw_position
from plancurate.tasks.learning.corrections import corrections
from plancurate.tasks.learning.demonstrations import Demonstrations, demonstrations
from plancurate.tasks.learning.join import join_demonstrations
from plancurate.tasks.learning.observations.clearances_by_detours import points_aside
from plancurate.tasks.learning.policies import TrainedPolicy
from plancurate.tasks.learning.rollouts import roll_out
from plancurate.tasks.learning.settings import TrainSettings
from plancurate.tasks.learning.test_targets import unseen_tests
from plancurate.tasks.learning.train import train
from plancurate.tasks.learning.training_goals import FloatArray, TrainingGoals
from plancurate.tasks.study.config import StudyConfig, load_config
from plancurate.tasks.study.statistics import wilson_interval

CONFIG = Path(__file__).with_name("clutter.yaml")
TRAINING_SCENES, TEST_SCENES = 10_000, 20_000  # the first of each
REFERENCE_TARGETS = 256
AT_GOAL_M = 1e-3
DETOURS = 3.0  # how much more often a step of a hard target is drawn: most targets need no detour
GOAL = "goal_offset"
ABSOLUTE = (
    "target_offset",
    "joint_positions",
)  # where the arm is, which in another scene means another thing
AROUND, AHEAD, DETOURED = "clearances_around", "clearances_ahead", "clearances_by_detours"
FELT = (AROUND, AHEAD, DETOURED)
Each = Callable[..., Iterable[Any]]
"""Like `map`: a function of one scene's problems, and these."""


@dataclass(frozen=True)
class Recipe:
    """How one row plans, what its policy sees, and how often it is corrected."""

    terms: tuple[str, ...] = FELT
    """Beside where the goal is."""
    continued: bool = True
    """Whether goals continue the reference's; else they are those nearest to home."""
    relaxed: bool = True
    """Whether paths are relaxed."""
    share: float = 1.0
    """Of the training scenes."""
    rounds: int = 0
    """Of corrections; each has a row of its own."""
    networks: int = 1
    """That are trained each time, from seeds of their own: the policy does the mean of what they do."""


ROWS: dict[str, Recipe] = {
    "everything": Recipe(rounds=3),
    "the mean of four networks": Recipe(rounds=3, networks=4),
    "joint angles and target, too": Recipe((*ABSOLUTE, *FELT)),
    "no clearances by detours": Recipe((AROUND, AHEAD)),
    "no clearances ahead": Recipe((AROUND, DETOURED)),
    "no clearances around": Recipe((AHEAD, DETOURED)),
    "paths not relaxed": Recipe(relaxed=False),
    "a quarter of the scenes": Recipe(share=0.25),
    "goals nearest to home": Recipe(continued=False),
    "no scene term": Recipe(ABSOLUTE),
    "clearances around and toward the goal": Recipe((*ABSOLUTE, AROUND, "clearances_toward_goal")),
    "nearest obstacle": Recipe((*ABSOLUTE, "nearest_obstacle")),
    "key collisions": Recipe((*ABSOLUTE, "key_collisions")),
    "scene parameters": Recipe((*ABSOLUTE, "scene_parameters")),
}


@dataclass(frozen=True, eq=False)
class Problems:
    """Targets in one scene, each with one goal.

    `paths` are the shortest planned ones (w, n), rad, None where no run succeeded, and `smooth` the same relaxed.
    """

    scene: int
    targets: list[Target]
    hard: list[bool]
    paths: list[FloatArray | None]
    smooth: list[FloatArray | None]


@dataclass(frozen=True)
class Rate:
    """Successes of n tests, and of the hard ones among them."""

    row: str
    n: int
    successes: int
    hard_n: int
    hard_successes: int


def main() -> None:
    """Plan, train, roll out, and print a line for each row."""
    asked = arguments()
    training_seeds = range(TRAINING_SCENES, TRAINING_SCENES + asked.training)
    test_seeds = range(TEST_SCENES, TEST_SCENES + asked.tests)
    rates: list[Rate] = []
    with ProcessPoolExecutor(asked.processes, mp_context=get_context("spawn")) as processes:
        for continued in sorted({ROWS[row].continued for row in asked.rows}, reverse=True):
            rows = [row for row in asked.rows if ROWS[row].continued == continued]
            plan = partial(planned_in, continued=continued)
            training, tests = (
                list(processes.map(plan, seeds, chunksize=5)) for seeds in (training_seeds, test_seeds)
            )
            rates += told(references(tests, continued))
            learn = partial(
                measure, training=training, tests=tests, settings=train_settings(asked.steps, asked.units)
            )
            for found in processes.map(learn, [row for row in rows if not ROWS[row].rounds]):
                rates += told(found)
            torch.set_num_threads(asked.processes)  # which from here on wait while a policy is trained
            for row in rows:
                if ROWS[row].rounds:  # corrections take the longest, and are made scene by scene
                    rates += told(learn(row, each=partial(processes.map, chunksize=5)))
    if asked.json:
        asked.json.write_text(json.dumps([asdict(rate) for rate in rates], indent=1) + "\n", encoding="utf-8")


def arguments() -> argparse.Namespace:
    """What is asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--training", type=int, default=500, help="scenes to train in")
    parser.add_argument("--steps", type=int, default=configuration().training.steps, help="gradient steps")
    parser.add_argument("--units", type=int, default=256, help="of each of the two hidden layers")
    parser.add_argument("--tests", type=int, default=40, help="scenes to test in")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--rows", nargs="+", default=list(ROWS), choices=list(ROWS), metavar="ROW")
    parser.add_argument("--json", type=Path)
    asked = parser.parse_args()
    if asked.training > TEST_SCENES - TRAINING_SCENES:
        parser.error(f"--training: at most {TEST_SCENES - TRAINING_SCENES}, so that no test scene trains")
    return asked


def told(rates: list[Rate]) -> list[Rate]:
    """Print rates for a person."""
    for rate in rates:
        parts = [share(rate.successes, rate.n), "hard", share(rate.hard_successes, rate.hard_n)]
        print(f"{rate.row:40} {' '.join(parts)}", flush=True)
    return rates


def share(successes: int, n: int) -> str:
    """A rate in percent with its interval."""
    if not n:
        return "none"
    interval = wilson_interval(successes, n)
    return f"{100 * successes / n:5.1f} ({100 * interval.low:.1f} to {100 * interval.high:.1f}, n {n})"


@cache
def configuration() -> StudyConfig:
    """What clutter.yaml says."""
    torch.set_num_threads(1)
    return load_config("smoke", CONFIG, {})


def candidate_settings() -> GenerateSettings:
    """How targets are drawn and planned to."""
    return configuration().pool_settings(configuration().pool_labels[0])


def train_settings(steps: int, units: int) -> TrainSettings:
    """How each policy is trained, but for what it observes."""
    changed = {"steps": steps, "policies": {"BC_MLP": {"hidden": [units, units]}}}
    return TrainSettings.model_validate(configuration().training.model_dump() | changed)


@cache
def arm() -> Robot:
    """The robot."""
    return load_robot(configuration().robot)


@cache
def scene_of(seed: int) -> Scene:
    """The member of the family with this seed."""
    return load_scene(f"clutter:{seed}", arm())


@cache
def reference() -> TrainingGoals:
    """Targets in the family's regions where no obstacles are, with goals that continue each other's."""
    settings, clutter = candidate_settings(), scene_of(0)
    consistent = settings.model_copy(
        update={"plan": settings.plan.model_copy(update={"goals": "consistent"})}
    )
    bare = replace(clutter, shapes=(), native=native_scene((), clutter.ground, clutter.margin))
    targets = draw_targets(arm(), bare, consistent, 0, REFERENCE_TARGETS)
    return TrainingGoals(
        np.stack([target.position for target in targets]), np.stack([target.goals[0] for target in targets])
    )


def planned_in(seed: int, continued: bool) -> Problems:
    """Draw the targets of a scene, other ones in each, and plan to them."""
    settings, scene = candidate_settings(), scene_of(seed)
    targets = targets_in(seed, continued)
    paths = [shortest(scene, target) for target in targets]
    smooth = [None if path is None else smoothed(scene, path) for path in paths]
    hard = [is_hard(arm(), scene, target.goals, settings) for target in targets]
    return Problems(seed, targets, hard, paths, smooth)


def targets_in(seed: int, continued: bool) -> list[Target]:
    """The targets of a scene, each with the one goal that is shown.

    Those to test at have a free goal, whichever it is. Those to train on are any positions of the regions that a
    continued goal reaches, which takes a fifth of the time; where goals nearest to home are asked for, as at tests.
    """
    config, settings, scene = configuration(), candidate_settings(), scene_of(seed)
    if seed >= TEST_SCENES:
        drawn = draw_targets(arm(), scene, settings, seed * config.unseen, config.unseen)
    elif continued:
        drawn = any_targets(scene, seed * config.n_targets, config.n_targets)
    else:
        drawn = draw_targets(arm(), scene, settings, seed * config.n_targets, config.n_targets)
    goals = continued_goals(scene, drawn) if continued else [nearest_goal(arm(), t.goals) for t in drawn]
    aimed = [replace(target, goals=goal[None]) for target, goal in zip(drawn, goals, strict=True)]
    return [target for target in aimed if seed >= TEST_SCENES or is_at_goal(target)]


def any_targets(scene: Scene, first: int, count: int) -> list[Target]:
    """Positions in the regions of a scene, without a goal."""
    rngs = [np.random.default_rng((candidate_settings().targets.seed, first + k)) for k in range(count)]
    positions = [draw_position(np.zeros(3), scene.regions, 0.0, rng) for rng in rngs]
    none = np.empty((0, arm().dof))
    return [Target(first + k, position, none) for k, position in enumerate(positions)]


def is_at_goal(target: Target) -> bool:
    """Whether the tool is at the target in its goal."""
    tool = native.fk(arm().native, target.goals)[0, :3, 3]
    return bool(np.linalg.norm(tool - target.position) < AT_GOAL_M)


def continued_goals(scene: Scene, targets: list[Target]) -> list[FloatArray]:
    """The goal (n,) of each target that agrees best with the reference's around it."""
    settings = candidate_settings()
    positions = np.stack([target.position for target in targets])
    seeds = [(settings.targets.seed, target.target_id, REFERENCE_TARGETS) for target in targets]
    kept, expected = planning_scene(scene, settings.plan), reference().at(positions)
    return list(
        agreeing_goals(arm(), kept, positions, expected, settings.targets, seeds, lambda i: targets[i].goals)
    )


def shortest(scene: Scene, target: Target) -> FloatArray | None:
    """The shortest path (w, n), rad, of the runs that reach a target."""
    planner, settings = configuration().planners[0], candidate_settings()
    runs = [plan_candidate(arm(), scene, target, planner, run, settings) for run in range(settings.plan.runs)]
    paths = [run.path for run in runs if run.status == "exact"]
    return min(paths, key=path_length, default=None)


def smoothed(scene: Scene, path: FloatArray) -> FloatArray:
    """The path relaxed with the clearance that it was planned with, or with none where it does not keep that."""
    plan = candidate_settings().plan
    kept = planning_scene(scene, plan)
    free = native.edge_is_free(arm().native, kept.native, path[:-1], path[1:], plan.resolution)
    return relaxed(arm(), scene, kept if free.all() else scene, path, plan.resolution, plan.seed)


def references(tests: list[Problems], continued: bool) -> list[Rate]:
    """What a planner reaches, the straight joint line, and the best of the detours that a policy feels at the start."""
    goals = "continued goals" if continued else "goals nearest to home"
    hard = [one for part in tests for one in part.hard]
    planned = [path is not None for part in tests for path in part.paths]
    detoured = [detour_is_free(part.scene, target) for part in tests for target in part.targets]
    return [
        counted(f"planner, {goals}", planned, hard),
        counted(f"straight line, {goals}", [not one for one in hard], hard),
        counted(f"that or a detour over one point, {goals}", detoured, hard),
    ]


def detour_is_free(scene: int, target: Target) -> bool:
    """Whether the straight way is free, or one over a point that `clearances_by_detours` feels around home."""
    robot, resolution = arm(), candidate_settings().plan.resolution
    over = np.concatenate([target.goals, points_aside(robot, robot.home[None])[0]])
    home, goal = (np.broadcast_to(q, over.shape).copy() for q in (robot.home, target.goals[0]))
    edges = np.concatenate([home, over]), np.concatenate([over, goal])
    free = native.edge_is_free(robot.native, scene_of(scene).native, *edges, resolution)
    return bool((free[: len(over)] & free[len(over) :]).any())


def measure(
    row: str, training: list[Problems], tests: list[Problems], settings: TrainSettings, each: Each = map
) -> list[Rate]:
    """Train by the recipe of a row and roll out in all test scenes; again after each round of corrections."""
    recipe = ROWS[row]
    training = training[: round(recipe.share * len(training))]
    settings = settings.model_copy(update={"observation": (GOAL, *recipe.terms)})
    hard = [one for part in tests for one in part.hard]
    rates = []
    for number, policy in enumerate(policies(recipe, training, settings, each)):
        success = [one for found in each(partial(reached, policy), tests) for one in found]
        rates.append(counted(f"{row}, round {number}" if recipe.rounds else row, success, hard))
        print(f"  {rates[-1].row}: tested", file=sys.stderr, flush=True)
    return rates


def policies(
    recipe: Recipe, training: list[Problems], settings: TrainSettings, each: Each
) -> Iterator[TrainedPolicy]:
    """The policy of a recipe, and that after each round of corrections."""
    training = [part for part in training if any(path is not None for path in part.paths)]
    shown = list(each(partial(shown_in, settings=settings, recipe=recipe), training))
    for number in range(recipe.rounds + 1):
        data, seeds = join_demonstrations(shown), range(recipe.networks)
        yield (policy := mean_policy(train("BC_MLP", [data] * recipe.networks, seeds, settings)))
        if number < recipe.rounds:
            corrected = each(partial(corrected_in, policy=policy, settings=settings), training)
            shown += [new for new in corrected if new is not None]


def shown_in(part: Problems, settings: TrainSettings, recipe: Recipe) -> Demonstrations:
    """Demonstrations of the paths planned in one scene."""
    known = [
        (k, path) for k, path in enumerate(part.smooth if recipe.relaxed else part.paths) if path is not None
    ]
    return demonstrations(
        arm(),
        scene_of(part.scene),
        [path for _, path in known],
        np.stack([part.targets[k].position for k, _ in known]),
        settings,
        weights=np.array([DETOURS if part.hard[k] else 1.0 for k, _ in known]),
    )


def corrected_in(part: Problems, policy: TrainedPolicy, settings: TrainSettings) -> Demonstrations | None:
    """Demonstrations from where a policy gets to on its way to targets of one scene; None where it needs none."""
    config, candidates, scene = configuration(), candidate_settings(), scene_of(part.scene)
    known = [k for k, path in enumerate(part.paths) if path is not None]
    aims = TrainingGoals(
        np.stack([part.targets[k].position for k in known]),
        np.concatenate([part.targets[k].goals for k in known]),
    )
    found = corrections(
        policy,
        arm(),
        scene,
        aims,
        candidates.plan,
        config.evaluation,
        config.corrections,
        candidates.timing.dt,
    )
    if not found:
        return None
    paths = [smoothed(scene, one.path) for one in found]
    return demonstrations(
        arm(), scene, paths, np.stack([aims.positions[one.target] for one in found]), settings
    )


def reached(policy: TrainedPolicy, part: Problems) -> list[bool]:
    """Which targets of a scene a policy reaches."""
    settings, dt = configuration().evaluation, candidate_settings().timing.dt
    goals = np.concatenate([target.goals for target in part.targets])[None]
    tests = unseen_tests(part.targets)
    trials = roll_out([policy], arm(), scene_of(part.scene), tests, settings, dt, goals)[0]
    success: list[bool] = trials["success"].to_pylist()
    return success


def counted(row: str, success: Iterable[bool], hard: Iterable[bool]) -> Rate:
    """Counts of a row."""
    reached, blocked = np.array(list(success)), np.array(list(hard))
    return Rate(row, len(reached), int(reached.sum()), int(blocked.sum()), int((reached & blocked).sum()))


if __name__ == "__main__":
    try:
        main()
    except PlancurateError as error:
        sys.exit(f"{error}")
