from itertools import pairwise

import numpy as np
import pytest

from plancurate.robots import load_robot, load_scene
from plancurate.tasks.candidates.path_classes import label_paths, resampled

ROBOT = load_robot("h2017")
BALL = "ground: null\nshapes: [{name: ball, kind: sphere, radius: 0.15, xyz: [0.62, 0.62, 1.2]}]\n"
HOME = ROBOT.home
LEFT = HOME + np.array([1.57, 0, 0, 0, 0, 0])


@pytest.fixture(scope="module")
def scenes(tmp_path_factory):
    """With and without a ball in the tool's way when the arm turns about its foot."""
    file = tmp_path_factory.mktemp("scene") / "ball.yaml"
    file.write_text(BALL)
    return load_scene(file), load_scene("free")


def by_way_of(lift, end=LEFT):
    """A path that lifts the arm by `lift` rad of its second joint (down for more) half-way."""
    return np.stack([HOME, (HOME + end) / 2 + np.array([0, lift, 0, 0, 0, 0]), end])


OVER, HIGH_OVER, UNDER = by_way_of(-0.7), by_way_of(-1.3), by_way_of(0.8)


def test_paths_on_either_side_of_an_obstacle_are_different_ways(scenes):
    ball, free = scenes
    assert label_paths(ROBOT, ball, [UNDER, OVER, HIGH_OVER], [0, 0, 0]) == ["g0.p1", "g0.p0", "g0.p0"]
    assert label_paths(ROBOT, free, [UNDER, OVER, HIGH_OVER], [0, 0, 0]) == ["g0.p0"] * 3


def test_the_shortest_path_has_the_first_label_whatever_the_order(scenes):
    paths = [HIGH_OVER, UNDER, OVER]
    labels = [
        label_paths(ROBOT, scenes[0], [paths[i] for i in order], [4] * 3) for order in ([0, 1, 2], [2, 0, 1])
    ]
    assert labels == [["g0.p0", "g0.p1", "g0.p0"], ["g0.p0", "g0.p0", "g0.p1"]]


def test_ends_that_differ_are_different_goal_classes_up_to_the_tolerance(scenes):
    near, far = LEFT + np.array([0, 0, 0, 0, 0, 0.8]), LEFT + np.array([0, 0, 0, 0, 0, 1.5])
    paths = [by_way_of(-0.1), by_way_of(-0.1, near), by_way_of(-0.1, far), by_way_of(0.3, far)]
    assert label_paths(ROBOT, scenes[1], paths, [0] * 4) == ["g0.p0", "g0.p0", "g1.p0", "g1.p0"]


def test_targets_are_labelled_apart_and_a_candidate_more_elsewhere_changes_nothing(scenes):
    alone = label_paths(ROBOT, scenes[0], [UNDER, OVER], [1, 1])
    mixed = label_paths(ROBOT, scenes[0], [UNDER, UNDER, OVER, OVER], [7, 1, 7, 1])
    assert [mixed[1], mixed[3]] == [mixed[0], mixed[2]] == alone
    assert label_paths(ROBOT, scenes[0], [], []) == []


def test_sampling_does_not_change_the_label(scenes):
    fine = np.concatenate([np.linspace(a, b, 30) for a, b in pairwise(UNDER)])
    assert label_paths(ROBOT, scenes[0], [fine, OVER, UNDER], [0, 0, 0]) == ["g0.p1", "g0.p0", "g0.p1"]
    np.testing.assert_allclose(resampled(fine), resampled(UNDER), atol=1e-9)


def test_a_path_that_stands_still_has_a_label(scenes):
    assert label_paths(ROBOT, scenes[1], [np.stack([HOME, HOME])], [0]) == ["g0.p0"]
