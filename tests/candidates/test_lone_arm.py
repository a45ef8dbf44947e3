"""PyBullet without shapes stands for PyBullet with all of them wherever nothing can touch."""

import numpy as np
import pytest

from plancurate import native
from plancurate.robots import load_robot, load_scene, load_world, robot_names
from plancurate.tasks.candidates import playback
from plancurate.tasks.candidates.payload import Payload
from plancurate.tasks.candidates.playback import drive, follow, keeps_apart, lone_arm_of_thread, references
from plancurate.tasks.candidates.settings import VerifySettings
from plancurate.tasks.candidates.simulation import World

SETTINGS = VerifySettings()
STEP_S = 1.0 / SETTINGS.frequency_hz
DT = 0.05
NEAR = 0.02  # m: PyBullet makes contact points of bodies this near, though nothing touches


def motion(start, goal, seconds=1.0):
    """References of a smooth motion, which asks more of the joints than they can where it is far."""

    def path(t):
        s = (t / seconds)[:, None]
        return start + (10 * s**3 - 15 * s**4 + 6 * s**5) * (goal - start)

    return references(path, 0.0, seconds, SETTINGS)


def some_motions(robot, scene, count):
    goals = np.random.default_rng(3).uniform(robot.lower, robot.upper, (count, robot.dof))
    found = [motion(robot.home, robot.home + 0.5 * (goal - robot.home)) for goal in goals]
    return [q for q in found if native.is_free(robot.native, scene.native, q).all()]


def in_the_world(robot, scene, wanted, payload=None):
    world = World()
    world.build(robot, scene, STEP_S, payload)
    return drive(world, robot, wanted, SETTINGS)


def assert_same_bits(one, other):
    assert one.q.tobytes() == other.q.tobytes()
    assert one.torque.tobytes() == other.torque.tobytes()
    assert one.touching == other.touching


@pytest.mark.slow
@pytest.mark.parametrize("payload", [None, Payload(mass_kg=8.0, centre_m=(0.0, 0.05, 0.1))])
@pytest.mark.parametrize("name", [*robot_names(), "scara"])
def test_where_nothing_touches_shapes_change_no_bit(name, payload, robot_folders):
    robot, scene = load_robot(robot_folders.get(name, name)), load_scene("free")
    motions = some_motions(robot, scene, 6)
    assert len(motions) > 1
    for wanted in motions:  # one after another in the same world of the arm alone
        assert_same_bits(
            follow(robot, scene, wanted, SETTINGS, payload), in_the_world(robot, scene, wanted, payload)
        )


def test_nor_do_shapes_that_are_near():
    robot, scene = load_world("h2017", "table")
    wanted = motion(robot.home, robot.home + np.array([0, 0.1, 0.3, 0, 0, 0]), 2.0)
    near = native.clearance(robot.native, scene.native, wanted).min()
    assert playback.APART < near < NEAR
    assert keeps_apart(robot, scene, wanted)
    assert_same_bits(follow(robot, scene, wanted, SETTINGS), in_the_world(robot, scene, wanted))


def test_the_world_is_asked_only_where_something_is_near(monkeypatch):
    robot, scene = load_world("h2017", "table")
    built = []
    monkeypatch.setattr(World, "build", lambda *given: built.append(given))
    follow(robot, scene, np.repeat(robot.home[None], 9, axis=0), SETTINGS)
    assert not built


def test_a_motion_that_blows_up_leaves_no_trace():
    robot = load_robot("h2017")
    arm = lone_arm_of_thread(robot, STEP_S, None)
    calm = motion(robot.home, robot.home + 0.2)
    before = drive(arm, robot, calm, SETTINGS)
    for far in (1e2, 1e30, 1e200):
        drive(arm, robot, motion(robot.home, robot.home + far), SETTINGS)
        assert_same_bits(drive(arm, robot, calm, SETTINGS), before)


def test_states_that_are_no_numbers_are_near_something():
    robot, scene = load_world("h2017", "free")
    assert not keeps_apart(robot, scene, np.full((2, robot.dof), np.nan))
