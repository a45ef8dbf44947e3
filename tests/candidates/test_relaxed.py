"""Relaxed paths: shorter, off obstacles, still free, and alike where they pass on the same side."""

from __future__ import annotations

import numpy as np
import pytest

from plancurate import native
from plancurate.robots import Robot, Scene, load_robot, load_scene, load_world
from plancurate.robots.scene import empty_scene
from plancurate.tasks.candidates import relaxed as module
from plancurate.tasks.candidates.generate import pool_id
from plancurate.tasks.candidates.goals import planning_scene
from plancurate.tasks.candidates.plan import plan_candidate
from plancurate.tasks.candidates.polylines import path_length
from plancurate.tasks.candidates.relaxed import relaxed, subdivided, trials
from plancurate.tasks.candidates.settings import GenerateSettings
from plancurate.tasks.candidates.targets import sample_target

from ..relaxing import cost, relaxed_in_numpy

RESOLUTION = 0.01
SETTINGS = GenerateSettings.model_validate(
    {"targets": {"orientation": "cone"}, "plan": {"goals": "nearest", "clearance_m": 0.025}}
)
RELAXED = SETTINGS.model_copy(update={"plan": SETTINGS.plan.model_copy(update={"simplification": "relaxed"})})


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("h2017")


@pytest.fixture(scope="module")
def clutter(robot: Robot) -> Scene:
    return load_scene("clutter:7", robot)


def planned(robot: Robot, scene: Scene, target: int, run: int) -> np.ndarray:
    kept = planning_scene(scene, SETTINGS.plan)
    drawn = sample_target(robot, kept, SETTINGS.targets, target)
    return plan_candidate(robot, scene, drawn, "RRTConnect", run, SETTINGS).path


def free(robot: Robot, scene: Scene, path: np.ndarray) -> bool:
    return bool(native.edge_is_free(robot.native, scene.native, path[:-1], path[1:], RESOLUTION).all())


def hard_targets(robot: Robot, scene: Scene, count: int) -> list[int]:
    """The first targets whose straight joint line is not free."""
    ends = {k: planned(robot, scene, k, 0) for k in range(20)}
    return [k for k, path in ends.items() if not free(robot, scene, path[[0, -1]])][:count]


def moved(robot: Robot, scene: Scene, path: np.ndarray, seed: int = 0) -> np.ndarray:
    kept = planning_scene(scene, SETTINGS.plan)
    return relaxed(robot, scene, kept, path, RESOLUTION, seed)


def test_a_way_round_nothing_becomes_a_straight_one(robot: Robot) -> None:
    corner = robot.home + np.array([np.zeros(6), 0.8 * np.eye(6)[0], np.full(6, 0.4)])
    path = moved(robot, empty_scene(), corner)
    np.testing.assert_array_equal(path[[0, -1]], corner[[0, -1]])
    assert path_length(path) == pytest.approx(np.linalg.norm(corner[-1] - corner[0]), rel=0.01)


@pytest.mark.slow
def test_relaxed_paths_cost_less_and_keep_the_clearance_that_they_were_planned_with(
    robot: Robot, clutter: Scene
) -> None:
    kept = planning_scene(clutter, SETTINGS.plan)
    for target in hard_targets(robot, clutter, 4):
        path = planned(robot, clutter, target, 0)
        found = moved(robot, clutter, path)
        np.testing.assert_array_equal(found[[0, -1]], path[[0, -1]])
        assert free(robot, kept, found)
        assert ((found >= robot.lower) & (found <= robot.upper)).all()
        before, after = (cost(robot, clutter, q[:-1], q[1:]).sum() for q in (subdivided(path), found))
        assert after < before
    np.testing.assert_array_equal(moved(robot, clutter, path), found)  # the same for the same seed


@pytest.mark.slow
@pytest.mark.parametrize("name", ["clutter:7", "passage"])
def test_the_compiled_core_moves_waypoints_as_numpy_does(name: str) -> None:
    robot, scene = load_world("h2017", name)
    kept = planning_scene(scene, SETTINGS.plan)
    for target in range(3):
        path = planned(robot, scene, target, 0)
        points = subdivided(path)
        tried = trials(len(points) - 2, robot.native.dof, np.random.default_rng(target))
        expected = relaxed_in_numpy(robot, scene, kept, points, *tried, RESOLUTION)
        assert (expected[1:-1] != points[1:-1]).any(axis=1).all()
        found = relaxed(robot, scene, kept, path, RESOLUTION, target)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)


def test_arrays_that_do_not_fit_the_path_are_refused(robot: Robot) -> None:
    def relax(path: np.ndarray, offsets: np.ndarray, pulls: np.ndarray) -> np.ndarray:
        scene = empty_scene().native
        return native.relax(
            robot.native, robot.native_without_pairs, scene, scene, path, offsets, pulls, RESOLUTION
        )

    path, offsets, pulls = np.zeros((4, 6)), np.zeros((5, 2, 7, 6)), np.zeros((5, 2, 2))
    np.testing.assert_array_equal(relax(path, offsets, pulls), path)
    with pytest.raises(ValueError, match="path: at least three waypoints"):
        relax(path[:2], offsets, pulls)
    with pytest.raises(ValueError, match=r"offsets has shape \(5, 1, 7, 6\), must be \(any, 2, any, 6\)"):
        relax(path, np.ascontiguousarray(offsets[:, :1]), pulls)
    with pytest.raises(ValueError, match=r"pulls has shape \(4, 2, 2\), must be \(5, 2, any\)"):
        relax(path, offsets, pulls[:4])
    with pytest.raises(ValueError, match="offsets: row 0, joint 0 is not finite"):
        relax(path, np.full_like(offsets, np.nan), pulls)


@pytest.mark.slow
def test_no_shortcut_leads_through_what_is_kept_free(robot: Robot, clutter: Scene) -> None:
    kept = planning_scene(clutter, SETTINGS.plan)
    for target in hard_targets(robot, clutter, 2):
        path = planned(robot, clutter, target, 0)
        found = relaxed(robot, empty_scene(), kept, path, RESOLUTION, 0)  # nothing but the length costs
        assert path_length(found) < path_length(path)
        assert free(robot, kept, found)


@pytest.mark.slow
def test_relaxed_paths_of_different_runs_are_more_alike(robot: Robot, clutter: Scene) -> None:
    planned_apart, relaxed_apart = [], []
    for target in hard_targets(robot, clutter, 4):
        runs = [planned(robot, clutter, target, run) for run in range(8)]
        halves = [min(runs[k::2], key=path_length) for k in (0, 1)]
        planned_apart.append(apart(*halves))
        relaxed_apart.append(apart(*(moved(robot, clutter, path, k) for k, path in enumerate(halves))))
    assert np.mean(relaxed_apart) < 0.5 * np.mean(planned_apart)


def apart(first: np.ndarray, second: np.ndarray) -> float:
    """One minus the cosine between the directions in which two paths set out."""
    a, b = (path[1] - path[0] for path in (first, second))
    return float(1 - a @ b / np.linalg.norm(a) / np.linalg.norm(b))


@pytest.mark.slow
def test_a_pool_may_ask_for_relaxed_paths(robot: Robot, clutter: Scene) -> None:
    kept = planning_scene(clutter, RELAXED.plan)
    drawn = sample_target(robot, kept, RELAXED.targets, 0)
    full, one = (
        plan_candidate(robot, clutter, drawn, "RRTConnect", 1, settings) for settings in (SETTINGS, RELAXED)
    )
    copy = relaxed(robot, clutter, kept, full.path, RESOLUTION)  # whichever run found that path
    np.testing.assert_array_equal(one.path, copy)
    np.testing.assert_array_equal(one.path[[0, -1]], full.path[[0, -1]])
    assert free(robot, kept, one.path)
    before, after = (cost(robot, clutter, q[:-1], q[1:]).sum() for q in (subdivided(full.path), one.path))
    assert after < before


def test_a_changed_way_of_relaxing_is_another_pool_of_relaxed_paths_alone(
    robot: Robot, clutter: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    pools = [pool_id(robot, clutter, settings) for settings in (RELAXED, SETTINGS)]
    monkeypatch.setattr(module, "REVISION", module.REVISION + 1)
    raised = [pool_id(robot, clutter, settings) for settings in (RELAXED, SETTINGS)]
    assert pools[0] != raised[0]
    assert pools[1] == raised[1]
    assert pools[0] != pools[1]


@pytest.mark.slow
def test_near_obstacles_a_length_costs_more(robot: Robot, clutter: Scene) -> None:
    away = cost(robot, empty_scene(), robot.home, robot.home + 0.1)
    assert away == pytest.approx(0.1 * np.sqrt(6))
    path = planned(robot, clutter, hard_targets(robot, clutter, 1)[0], 0)
    straight = cost(robot, clutter, path[0], path[-1])
    assert 1.1 < straight / np.linalg.norm(path[-1] - path[0]) <= 5


def test_waypoints_are_set_between_those_that_are_far_apart(robot: Robot) -> None:
    path = np.array([[0.0, 0.0], [1.5, 0.0], [1.5, 0.5]])
    assert subdivided(path).tolist() == [[0, 0], [0.5, 0], [1, 0], [1.5, 0], [1.5, 0.5]]
    assert subdivided(path[1:]).tolist() == [[1.5, 0], [1.5, 0.25], [1.5, 0.5]]
