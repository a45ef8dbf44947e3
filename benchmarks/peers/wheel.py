"""Planning by OMPL's Python wheel with PyBullet's state checks: what `native` is compared with."""

from __future__ import annotations

import time
from dataclasses import dataclass

from ompl import base, geometric, util

from peers.checks import BulletChecks, BulletPairChecks
from plancurate.robots import Robot, load_robot, load_scene
from plancurate.robots.shapes import FloatArray

SETTERS = {
    "range": "setRange",
    "goal_bias": "setGoalBias",
    "num_samples": "setNumSamples",
    "radius_multiplier": "setRadiusMultiplier",
    "border_fraction": "setBorderFraction",
    "min_valid_path_fraction": "setMinValidPathFraction",
    "failed_expansion_score_factor": "setFailedExpansionCellScoreFactor",
}


@dataclass
class Solve:
    """One run of a planner, in seconds of processor time: other programs on the machine don't count."""

    solved: bool
    state_checks: int
    seconds: float


def wheel_planners() -> list[str]:
    """Names of the planners that the wheel binds."""
    return [name for name in dir(geometric) if hasattr(getattr(geometric, name), "solve")]


def wheel_solve(
    names: tuple[str, str],
    planner: str,
    params: dict[str, str],
    goals: FloatArray,
    resolution: float,
    seconds: float,
    pairwise: bool,
) -> Solve:
    """Plan from home to `goals` (g, n) with the wheel, asking PyBullet about each state.

    `names` are a robot's and a scene's, so that another process can be asked to do it.
    """
    util.noOutputHandler()
    robot, scene = load_robot(names[0]), load_scene(names[1])
    checks, count = (BulletPairChecks if pairwise else BulletChecks)(robot, scene), 0

    def is_free(state: base.State) -> bool:
        nonlocal count
        count += 1
        return checks.is_free([state[i] for i in range(robot.dof)])

    setup = geometric.SimpleSetup(joint_space(robot))
    setup.setStateValidityChecker(is_free)
    information = setup.getSpaceInformation()
    space = information.getStateSpace()
    information.setStateValidityCheckingResolution(resolution / space.getMaximumExtent())
    setup.setStartState(state_of(space, robot.home))
    goal = base.GoalStates(information)
    for q in goals:
        goal.addState(state_of(space, q))
    setup.setGoal(goal)
    setup.setPlanner(wheel_planner(planner, params, information))
    start = time.process_time()
    setup.solve(seconds)
    return Solve(setup.haveExactSolutionPath(), count, time.process_time() - start)


def wheel_planner(name: str, params: dict[str, str], information: base.SpaceInformation) -> base.Planner:
    """Build a planner with the same parameters as native's, as far as the wheel lets them be set."""
    planner = getattr(geometric, name)(information)
    for param, value in params.items():
        if hasattr(planner, SETTERS.get(param, "")):
            kind = int if param == "num_samples" else float
            getattr(planner, SETTERS[param])(kind(value))
    return planner


def joint_space(robot: Robot) -> base.RealVectorStateSpace:
    """Build the wheel's space of the robot's joints."""
    space, bounds = base.RealVectorStateSpace(robot.dof), base.RealVectorBounds(robot.dof)
    for joint in range(robot.dof):
        bounds.setLow(joint, float(robot.lower[joint]))
        bounds.setHigh(joint, float(robot.upper[joint]))
    space.setBounds(bounds)
    return space


def state_of(space: base.RealVectorStateSpace, q: FloatArray) -> base.State:
    """Copy joint positions (n,) into a state of the wheel's."""
    state = space.allocState()
    for joint, value in enumerate(q):
        state[joint] = float(value)
    return state
