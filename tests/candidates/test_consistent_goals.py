"""Goals that continue a neighbouring target's: alike from target to target, and the same however a pool grows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from plancurate import native
from plancurate.robots import load_world
from plancurate.tasks.candidates import consistent_goals
from plancurate.tasks.candidates.consistent_goals import consistent_goal, draw_targets, neighbours_goal
from plancurate.tasks.candidates.generate import pool_id
from plancurate.tasks.candidates.goals import planning_scene, tool_rotation
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


@pytest.mark.slow
def test_neighbouring_targets_are_reached_alike(record_property: Record) -> None:
    drawn, continued = (neighbours_alike(goals, 24) for goals in ("pose", "consistent"))
    record_property("alike", (drawn, continued))
    assert drawn < 0.3
    assert continued > 0.6


@pytest.mark.slow
@pytest.mark.parametrize("orientation", ["exact", "yaw_free", "cone", "any"])
def test_a_target_has_one_goal_that_is_free_and_within_the_tolerance(orientation: Orientation) -> None:
    chosen = settings(orientation=orientation)
    kept = planning_scene(SHELF, chosen.plan)
    axis = tool_rotation(ROBOT, SHELF)[:, 2]
    limit = {"exact": 1e-6, "yaw_free": 1e-6, "cone": np.radians(30) + 1e-6, "any": np.pi}[orientation]
    for target in draw_targets(ROBOT, SHELF, chosen, 0, 4):
        tool = native.fk(ROBOT.native, target.goals)
        assert target.goals.shape == (1, 6)
        assert np.abs(tool[:, :3, 3] - target.position).max() < 1e-6
        assert native.is_free(ROBOT.native, kept.native, target.goals).all()
        assert np.arccos(np.clip(tool[:, :3, 2] @ axis, -1, 1)).max() <= limit


def test_no_drawn_solution_is_nearer_to_what_the_earlier_targets_suggest() -> None:
    targets = draw_targets(ROBOT, SHELF, settings(), 0, 8)
    base = draw_targets(ROBOT, SHELF, settings("all"), 0, 8)
    for target, plain in zip(targets, base, strict=True):
        reference = neighbours_goal(ROBOT, target.position, targets[: target.target_id])
        assert np.array_equal(target.position, plain.position)
        nearest = np.linalg.norm(plain.goals - reference, axis=1).min()
        assert np.linalg.norm(target.goals[0] - reference) <= nearest


def test_where_a_goal_cannot_be_continued_the_nearest_free_solution_is_taken() -> None:
    chosen = settings()
    kept = planning_scene(SHELF, chosen.plan)
    target = draw_targets(ROBOT, SHELF, chosen, 0, 1)[0]
    # Known with the elbow turned over, beyond the limits: nothing continues from there.
    strange = replace(target, goals=np.array([[0.0, 9.0, -9.0, 9.0, 9.0, 9.0]]))
    goal = consistent_goal(ROBOT, kept, target, [strange], chosen.targets)
    assert native.is_free(ROBOT.native, kept.native, goal[None]).all()
    assert (goal >= ROBOT.lower).all()
    assert (goal <= ROBOT.upper).all()
    assert (
        np.linalg.norm(goal - strange.goals[0])
        <= np.linalg.norm(target.goals - strange.goals[0], axis=1).min()
    )


@pytest.mark.slow
def test_a_pool_that_grows_keeps_what_it_has() -> None:
    whole = draw_targets(ROBOT, SHELF, settings(), 0, 9)
    first = draw_targets(ROBOT, SHELF, settings(), 0, 4)
    assert same(whole[:4], first)
    assert same(whole[4:], draw_targets(ROBOT, SHELF, settings(), 4, 5, first))
    later = replace(
        whole[4], target_id=6, goals=ROBOT.home[None] + 1.0
    )  # known, as when lost ones are drawn again
    assert same(whole[4:6], draw_targets(ROBOT, SHELF, settings(), 4, 2, [later, *first]))


def test_a_changed_way_of_continuing_goals_is_another_pool(monkeypatch: pytest.MonkeyPatch) -> None:
    ids = [pool_id(ROBOT, SHELF, settings(goals)) for goals in ("consistent", "pose")]
    monkeypatch.setattr(consistent_goals, "REVISION", consistent_goals.REVISION + 1)
    raised = [pool_id(ROBOT, SHELF, settings(goals)) for goals in ("consistent", "pose")]
    assert ids[0] != raised[0]
    assert ids[1] == raised[1]
