"""Goals that continue a neighbouring target's: alike from target to target, and the same however a pool grows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from plancurate import native
from plancurate.robots import load_world
from plancurate.tasks.candidates.consistent_goals import draw_targets
from plancurate.tasks.candidates.goals import planning_scene, run_goals, tool_rotation
from plancurate.tasks.candidates.path_classes import GOAL_RADIUS
from plancurate.tasks.candidates.plan import plan_candidate
from plancurate.tasks.candidates.settings import (
    GenerateSettings,
    Goals,
    Orientation,
    PlanSettings,
    TargetSettings,
)
from plancurate.tasks.candidates.targets import Target

Record = Callable[[str, object], None]
ROBOT, SHELF = load_world("h2017", "shelf")


def settings(goals: Goals = "consistent", orientation: Orientation = "cone") -> GenerateSettings:
    return GenerateSettings(
        targets=TargetSettings(orientation=orientation, cone_deg=30),
        plan=PlanSettings(goals=goals, clearance_m=0.02),
    )


def same(a: Sequence[Target], b: Sequence[Target]) -> bool:
    return all(
        one.target_id == other.target_id
        and np.array_equal(one.position, other.position)
        and np.array_equal(one.goals, other.goals)
        for one, other in zip(a, b, strict=True)
    )


def neighbours_alike(goals: Goals, count: int) -> float:
    """Share of pairs of a target and one of its two nearest whose runs end in the same goal class."""
    chosen = settings(goals)
    targets = draw_targets(ROBOT, SHELF, chosen, 0, count)
    planned = [plan_candidate(ROBOT, SHELF, target, "RRTConnect", 0, chosen) for target in targets]
    ends = {i: one.path[-1] for i, one in enumerate(planned) if one.status == "exact"}
    assert len(ends) >= 0.9 * count
    positions = np.array([target.position for target in targets])
    pairs = [
        (i, j)
        for i in ends
        for j in np.linalg.norm(positions - positions[i], axis=1).argsort()[1:3].tolist()
        if j in ends
    ]
    return float(np.mean([np.abs(ends[i] - ends[j]).max() <= GOAL_RADIUS for i, j in pairs]))


def test_neighbouring_targets_are_reached_alike(record_property: Record) -> None:
    drawn, continued = (neighbours_alike(goals, 24) for goals in ("pose", "consistent"))
    record_property("alike", (drawn, continued))
    assert drawn < 0.3
    assert continued > 0.6


@pytest.mark.parametrize("orientation", ["exact", "cone", "any"])
def test_goals_are_free_within_the_tolerance_and_of_one_class(orientation: Orientation) -> None:
    chosen = settings(orientation=orientation)
    kept = planning_scene(SHELF, chosen.plan)
    axis = tool_rotation(ROBOT, SHELF)[:, 2]
    limit = {"exact": 1e-6, "cone": np.radians(30) + 1e-6, "any": np.pi}[orientation]
    for target in draw_targets(ROBOT, SHELF, chosen, 0, 4):
        tools = native.fk(ROBOT.native, target.goals)
        assert 1 <= len(target.goals) <= chosen.plan.goal_draws
        assert np.abs(tools[:, :3, 3] - target.position).max() < 1e-6
        assert native.is_free(ROBOT.native, kept.native, target.goals).all()
        assert np.ptp(target.goals, axis=0).max() <= GOAL_RADIUS
        assert np.arccos(np.clip(tools[:, :3, 2] @ axis, -1, 1)).max() <= limit


def test_the_first_goal_is_the_nearest_to_that_of_the_nearest_earlier_target() -> None:
    targets = draw_targets(ROBOT, SHELF, settings(), 0, 8)
    base = draw_targets(ROBOT, SHELF, settings("all"), 0, 8)
    for target, plain in zip(targets, base, strict=True):
        earlier = targets[: target.target_id]
        reference = ROBOT.home
        if earlier:
            away = [float(np.linalg.norm(other.position - target.position)) for other in earlier]
            reference = earlier[int(np.argmin(away))].goals[0]
        apart = np.linalg.norm(target.goals - reference, axis=1)
        assert np.all(np.diff(apart) >= 0)
        assert apart[0] <= np.linalg.norm(plain.goals - reference, axis=1).min()
        assert np.array_equal(target.position, plain.position)


def test_a_pool_that_grows_keeps_what_it_has() -> None:
    whole = draw_targets(ROBOT, SHELF, settings(), 0, 9)
    first = draw_targets(ROBOT, SHELF, settings(), 0, 4)
    assert same(whole[:4], first)
    assert same(whole[4:], draw_targets(ROBOT, SHELF, settings(), 4, 5, first))
    later = replace(
        whole[4], target_id=6, goals=ROBOT.home[None] + 1.0
    )  # known, as when lost ones are drawn again
    assert same(whole[4:6], draw_targets(ROBOT, SHELF, settings(), 4, 2, [later, *first]))


def test_each_run_draws_one_of_the_targets_goals() -> None:
    chosen = settings()
    target = max(draw_targets(ROBOT, SHELF, chosen, 0, 4), key=lambda target: len(target.goals))
    assert len(target.goals) > 1
    kept = planning_scene(SHELF, chosen.plan)
    drawn = [run_goals(ROBOT, kept, target, seed, chosen) for seed in range(40)]
    assert np.array_equal(drawn[3], run_goals(ROBOT, kept, target, 3, chosen))
    assert {goals.shape for goals in drawn} == {(1, 6)}
    assert {goals.tobytes() for goals in drawn} == {goal[None].tobytes() for goal in target.goals}
