"""Observation terms of the scene, by hand and against PyBullet's closest points."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from plancurate import native
from plancurate.robots import Robot, Scene, load_robot, load_scene
from plancurate.robots.scene import SceneShape, native_scene
from plancurate.robots.shapes import Kind, Shape, transform
from plancurate.tasks.candidates.bullet import bullet
from plancurate.tasks.learning.observations import observe, state_at
from plancurate.tasks.learning.observations.clearances_by_detours import directions
from plancurate.tasks.learning.observations.key_collisions import key_configurations

Bodies = Callable[[Robot, Scene], object]
RIGHT = np.pi / 2


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("h2017")


@pytest.fixture(scope="module")
def clutter(robot: Robot) -> Scene:
    return load_scene("clutter:7", robot)


def scene_of(*shapes: Shape, ground: float | None = None) -> Scene:
    named = tuple(SceneShape(f"s{k}", shape) for k, shape in enumerate(shapes))
    return Scene("by_hand", named, ground, 0.0, native_scene(named, ground, 0.0), "")


def shape(
    kind: Kind,
    size: tuple[float, float, float],
    xyz: tuple[float, float, float],
    rpy: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Shape:
    return Shape(kind, size, transform(xyz, rpy))


def seen(term: str, robot: Robot, scene: Scene, q: np.ndarray, goal: np.ndarray | None = None) -> np.ndarray:
    return observe([term], state_at(robot, scene, q, np.zeros((len(q), 3)), previous_q=q, goal=goal))


def around_home(robot: Robot, count: int, spread: float = 0.5) -> np.ndarray:
    return robot.home + np.random.default_rng(3).uniform(-spread, spread, (count, robot.dof))


class Closest:
    """PyBullet's nearest points of each moving link and the obstacles."""

    def __init__(self, judge: Bodies, robot: Robot, scene: Scene) -> None:
        self.world = judge(robot, scene).world  # type: ignore[attr-defined]
        index = {name: number for (body, number), name in self.world.names.items() if body == self.world.body}
        self.obstacles = [body for body, _ in self.world.names if body != self.world.body]
        frames = {s.frame for s in robot.shapes if s.frame and s.link not in robot.scene_unchecked_links}
        self.links = [
            sorted({index[s.link] for s in robot.shapes if s.frame == frame}) for frame in sorted(frames)
        ]

    def at(self, q: np.ndarray) -> list[list[tuple[float, np.ndarray]]]:
        """For each moving link the distance of each obstacle in reach and the way to it, m, nearest first."""
        self.world.place(q.tolist())
        return [sorted(self._of(links), key=lambda found: found[0]) for links in self.links]

    def nearest(self, q: np.ndarray) -> float:
        """Distance of the arm from all obstacles, m, from 0 to 0.3."""
        return min(0.3, max(0.0, min(found[0][0] for found in self.at(q) if found)))

    def _of(self, links: list[int]) -> list[tuple[float, np.ndarray]]:
        pairs = [(link, body) for link in links for body in self.obstacles]
        points = [
            bullet.getClosestPoints(
                self.world.body, body, 1.0, linkIndexA=link, physicsClientId=self.world.client
            )
            for link, body in pairs
        ]
        nearest = [min(found, key=lambda point: point[8]) for found in points if found]
        return [(point[8], np.subtract(point[6], point[5])) for point in nearest]


def test_the_nearest_obstacle_of_each_link_is_where_pybullet_sees_it(
    robot: Robot, clutter: Scene, judge: Bodies
) -> None:
    q = around_home(robot, 60)
    ours = seen("nearest_obstacle", robot, clutter, q).reshape(len(q), 6, 4)
    closest, compared = Closest(judge, robot, clutter), 0
    for state, links in zip(q, ours, strict=True):
        for (near, *direction), found in zip(links, closest.at(state), strict=True):
            (distance, way), (second, _) = found[:2]
            assert near == pytest.approx(min(max(distance, 0.0), 0.3), abs=2e-3)
            if (
                0.02 < distance < 0.29 and second > distance + 0.02
            ):  # one is the nearest, wherever it moves a little
                assert np.dot(direction, way) / np.linalg.norm(way) > 0.995
                assert np.linalg.norm(direction) == pytest.approx(1.0)
                compared += 1
    assert compared > 100


def test_the_floor_is_below_and_nothing_has_no_direction(robot: Robot) -> None:
    q = around_home(robot, 20, spread=0.2)
    below = float(native.fk(robot.native, robot.home[None])[0, 2, 3]) - 0.3
    high = seen("nearest_obstacle", robot, scene_of(ground=below), q).reshape(-1, 6, 4)[:, 5]
    higher = seen("nearest_obstacle", robot, scene_of(ground=below + 0.05), q).reshape(-1, 6, 4)[:, 5]
    between = (high[:, 0] < 0.3) & (higher[:, 0] > 0)
    assert between.sum() > 3
    np.testing.assert_allclose((high - higher)[between, 0], 0.05, atol=1e-4)
    np.testing.assert_allclose(high[between, 1:], [[0, 0, -1]] * between.sum(), atol=1e-4)
    out_of_range = scene_of(ground=below - 0.302 + high[0, 0])  # but not if moved
    assert seen("nearest_obstacle", robot, out_of_range, q[:1])[0, -4:].tolist() == [0.3, 0, 0, 0]
    touching = seen("nearest_obstacle", robot, scene_of(ground=5.0), q)
    assert not touching.any()
    empty = seen("nearest_obstacle", robot, scene_of(), q).reshape(-1, 6, 4)
    np.testing.assert_array_equal(empty, np.broadcast_to([0.3, 0, 0, 0], empty.shape))


def test_clearances_around_are_pybullets_with_one_joint_after_the_other_moved(
    robot: Robot, clutter: Scene, judge: Bodies
) -> None:
    q = around_home(robot, 8)
    ours = seen("clearances_around", robot, clutter, q)
    closest = Closest(judge, robot, clutter)
    for state, felt in zip(q, ours, strict=True):
        moved = [state, *(state - 0.15 * np.eye(6)), *(state + 0.15 * np.eye(6))]
        np.testing.assert_allclose(felt, [closest.nearest(one) for one in moved], atol=2e-3)
    assert (np.ptp(ours, axis=1) > 0.01).sum() > 2
    assert seen("clearances_around", robot, scene_of(), q).tolist() == [[0.3] * 13] * 8


def test_clearances_toward_the_goal_are_those_on_the_way_and_end_there(robot: Robot, clutter: Scene) -> None:
    q = np.tile(around_home(robot, 5)[4], (3, 1))  # next to an obstacle
    way = np.array([2.0, -1.0, 2.0, 0.0, 0.0, 0.0]) / 3
    lengths = np.array([[1.0], [0.1], [0.0]])
    steps = np.array([[0.06, 0.12, 0.18], [0.06, 0.1, 0.1], [0.0, 0.0, 0.0]])
    ours = seen("clearances_toward_goal", robot, clutter, q, goal=q + lengths * way)
    for state, gone, felt in zip(q, steps, ours, strict=True):
        there = seen("clearances_around", robot, clutter, state + gone[:, None] * way)[:, 0]
        np.testing.assert_allclose(felt, there, atol=1e-9)
    assert abs(np.diff(ours[0])).min() > 1e-3


def test_key_collisions_are_pybullets_and_hold_for_all_states_of_a_scene(
    robot: Robot, clutter: Scene, judge: Bodies
) -> None:
    q, other = around_home(robot, 4), load_scene("clutter:8", robot)
    bits = seen("key_collisions", robot, clutter, q)
    assert (bits == bits[0]).all()
    closest = Closest(judge, robot, clutter)
    theirs = np.array([closest.nearest(key) for key in key_configurations(robot)])
    assert not bits[0][theirs > clutter.margin + 2e-3].any()
    assert bits[0][theirs == 0].all()
    assert 0.05 < bits[0].mean() < 0.6
    assert (seen("key_collisions", robot, other, q)[0] != bits[0]).sum() > 10
    np.testing.assert_array_equal(seen("key_collisions", robot, clutter, q), bits)
    np.testing.assert_array_equal(
        seen("key_collisions", robot, clutter.grown(0.2), q).mean() > bits.mean(), True
    )


def test_scene_parameters_are_the_nearest_obstacles_with_the_boxes_around_them(robot: Robot) -> None:
    shapes = (
        shape("sphere", (0.1, 0, 0), (0, 0, 3)),
        shape("box", (0.1, 0.2, 0.3), (1, 0, 0), (0, 0, RIGHT)),
        shape("capsule", (0.1, 0.4, 0), (0, 2, 0), (0, RIGHT, 0)),
        shape("cylinder", (0.1, 0.4, 0), (0, 0, -4), (RIGHT / 2, 0, 0)),
    )
    told = seen("scene_parameters", robot, scene_of(*shapes), around_home(robot, 2)).reshape(2, 12, 6)
    turned = 0.5 * np.sqrt(0.5)  # radius and half length of the cylinder at 45 degrees
    expected = [
        [1, 0, 0, 0.2, 0.1, 0.3],
        [0, 2, 0, 0.5, 0.1, 0.1],
        [0, 0, 3, 0.1, 0.1, 0.1],
        [0, 0, -4, 0.1, turned, turned],
    ]
    for one in told:
        np.testing.assert_allclose(one[:4], expected, atol=1e-12)
        assert not one[4:].any()
    many = scene_of(*(shape("sphere", (0.1, 0, 0), (k, 0, 0)) for k in range(20, 0, -1)))
    rows = seen("scene_parameters", robot, many, around_home(robot, 1)).reshape(12, 6)
    assert rows[:, 0].tolist() == list(range(1, 13))


def test_clearances_ahead_are_at_each_quarter_of_the_way_and_to_the_sides_of_it(
    robot: Robot, clutter: Scene
) -> None:
    q, goal = around_home(robot, 6), around_home(robot, 6)[::-1]
    ours = seen("clearances_ahead", robot, clutter, q, goal).reshape(6, 4, 13)
    sides = np.concatenate([np.zeros((1, 6)), -0.4 * np.eye(6), 0.4 * np.eye(6)])
    for start, end, felt in zip(q, goal, ours, strict=True):
        for quarter in range(4):
            there = start + (quarter + 1) / 4 * (end - start) + sides
            np.testing.assert_allclose(
                felt[quarter], seen("clearances_around", robot, clutter, there)[:, 0], atol=1e-9
            )
    assert (np.ptp(ours, axis=2) > 0.01).sum() > 5


def test_clearances_by_detours_are_the_least_on_each_of_the_ways(robot: Robot, clutter: Scene) -> None:
    q, goal = around_home(robot, 5), around_home(robot, 5)[::-1]
    ours = seen("clearances_by_detours", robot, clutter, q, goal)
    assert ours.shape == (5, 44)
    for way, direction in enumerate(directions(6)):
        assert np.linalg.norm(direction) == pytest.approx(1.0)
        for start, end, felt in zip(q, goal, ours[:, way], strict=True):
            aside = np.clip(start + 0.6 * direction, robot.lower, robot.upper)
            points = [
                (start + aside) / 2,
                aside,
                *(aside + share * (end - aside) for share in np.arange(1, 6) / 6),
            ]
            on_it = seen("clearances_around", robot, clutter, np.array(points))[:, 0]
            assert felt == pytest.approx(on_it.min(), abs=1e-9)
    assert (np.ptp(ours, axis=1) > 0.02).sum() > 2


def test_detours_of_many_states_are_felt_part_by_part(
    robot: Robot, clutter: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    q, goal = around_home(robot, 7), around_home(robot, 7)[::-1]
    together = seen("clearances_by_detours", robot, clutter, q, goal)
    monkeypatch.setattr("plancurate.tasks.learning.observations.clearances_by_detours.AT_ONCE", 3)
    np.testing.assert_array_equal(seen("clearances_by_detours", robot, clutter, q, goal), together)


def test_terms_depend_on_each_state_alone(robot: Robot, clutter: Scene) -> None:
    q, goal = around_home(robot, 13), around_home(robot, 13)[::-1]
    for term in (
        "clearances_around",
        "clearances_toward_goal",
        "clearances_ahead",
        "clearances_by_detours",
        "nearest_obstacle",
    ):
        together = seen(term, robot, clutter, q, goal)
        alone = [seen(term, robot, clutter, q[k : k + 1], goal[k : k + 1])[0] for k in range(13)]
        np.testing.assert_array_equal(together, alone)
