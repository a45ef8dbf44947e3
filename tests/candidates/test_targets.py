from dataclasses import replace

import numpy as np
import pytest

from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.robots import load_robot, load_scene
from plancurate.tasks.candidates.settings import TargetSettings
from plancurate.tasks.candidates.targets import sample_targets

ROBOT = load_robot("h2017")
SCENE = load_scene("table")
HOME = native.fk(ROBOT.native, ROBOT.home[None])[0]
SETTINGS = TargetSettings(orientation="exact")


def test_many_targets_begin_with_the_same_few():
    many, few = (sample_targets(ROBOT, SCENE, SETTINGS, 0, count) for count in (12, 4))
    later = sample_targets(ROBOT, SCENE, SETTINGS, 7, 2)
    assert [target.target_id for target in many] == list(range(12))
    for a, b in [*zip(many[:4], few, strict=True), *zip(many[7:9], later, strict=True)]:
        assert a.target_id == b.target_id
        assert np.array_equal(a.position, b.position)
        assert np.array_equal(a.goals, b.goals)


@pytest.mark.slow
def test_targets_lie_in_the_cube_and_not_at_its_middle():
    settings = TargetSettings(range_m=0.3, min_distance_m=0.12)
    offsets = np.array([t.position for t in sample_targets(ROBOT, SCENE, settings, 0, 30)]) - HOME[:3, 3]
    assert np.abs(offsets).max() <= 0.15
    assert np.linalg.norm(offsets, axis=1).min() >= 0.12
    assert np.abs(offsets).max(axis=0).min() > 0.1  # all along every axis


def test_goals_reach_the_target_in_the_home_orientation_without_collision():
    for target in sample_targets(ROBOT, SCENE, SETTINGS, 0, 10):
        poses = native.fk(ROBOT.native, target.goals)
        np.testing.assert_allclose(poses[:, :3, 3], np.tile(target.position, (len(poses), 1)), atol=2e-6)
        np.testing.assert_allclose(poses[:, :3, :3], np.tile(HOME[:3, :3], (len(poses), 1, 1)), atol=2e-6)
        assert native.is_free(ROBOT.native, SCENE.native, target.goals).all()
        assert np.all((target.goals >= ROBOT.lower) & (target.goals <= ROBOT.upper))


def test_another_seed_gives_other_targets():
    one, other = (sample_targets(ROBOT, SCENE, TargetSettings(seed=seed), 0, 1)[0] for seed in (0, 1))
    assert not np.array_equal(one.position, other.position)


def test_an_unreachable_cube_is_an_error_that_says_so():
    settings = TargetSettings(range_m=0.1, min_distance_m=0.2, max_tries=5)
    with pytest.raises(
        PlancurateError, match=r"h2017 in scene 'table' reaches none of 5 positions .*range_m=0\.1"
    ):
        sample_targets(ROBOT, SCENE, settings, 0, 1)


def test_a_home_that_collides_is_an_error_that_says_so():
    folded = replace(ROBOT, home=np.array([0.0, 1.5, 2.2, 0, 0, 0]))
    assert not native.is_free(folded.native, SCENE.native, folded.home[None])[0]
    with pytest.raises(PlancurateError, match="home: collides in scene 'table'"):
        sample_targets(folded, SCENE, SETTINGS, 0, 1)
