from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from plancurate import native
from plancurate.robots import load_robot, load_scene, robot_names, solve_ik

H2017 = load_robot("h2017")
FREE = load_scene("free")


def closed_form(pose):
    """All solutions of the H2017, limits and collisions aside, by geometry: an oracle."""
    shoulder, side, upper, fore, wrist = 0.3443, 0.0099, 0.845, 0.734, 0.121
    centre = pose[:3, 3] - wrist * pose[:3, 2]
    found = []
    for front, elbow, flip in product((1, -1), (1, -1), (1, -1)):
        out2 = centre[0] ** 2 + centre[1] ** 2 - side**2
        up = centre[2] - shoulder
        cosine = (out2 + up**2 - upper**2 - fore**2) / (2 * upper * fore)
        if out2 < 0 or abs(cosine) > 1:
            continue
        out = front * np.sqrt(out2)
        q1 = np.arctan2(centre[1], centre[0]) - np.arctan2(side, out)
        q3 = elbow * np.arccos(cosine)
        q2 = np.arctan2(out, up) - np.arctan2(fore * np.sin(q3), upper + fore * np.cos(q3))
        arm = Rotation.from_euler("ZY", [q1, q2 + q3])
        q4, q5, q6 = (arm.inv() * Rotation.from_matrix(pose[:3, :3])).as_euler("ZYZ")
        if flip < 0:
            q4, q5, q6 = q4 + np.pi, -q5, q6 + np.pi
        found.append([q1, q2, q3, q4, q5, q6])
    return (np.array(found).reshape(-1, 6) + np.pi) % (2 * np.pi) - np.pi


def tool_error(robot, q, pose):
    poses = native.fk(robot.native, q)
    turn = Rotation.from_matrix(poses[:, :3, :3]).inv() * Rotation.from_matrix(pose[:3, :3])
    return np.linalg.norm(poses[:, :3, 3] - pose[:3, 3], axis=1).max(), turn.magnitude().max()


def random_pose(robot, rng):
    q = rng.uniform(robot.lower, robot.upper)
    return native.fk(robot.native, q[None])[0]


def solve_pose(robot, pose, seed=0, scene=FREE, **options):
    return solve_ik(robot, scene, pose[:3, 3], pose[:3, :3], np.random.default_rng(seed), **options)


@pytest.mark.slow
def test_it_finds_every_free_solution_of_the_closed_form():
    rng = np.random.default_rng(7)
    count = 0
    for seed in range(150):
        pose = random_pose(H2017, rng)
        wanted = closed_form(pose)
        wanted = wanted[((wanted >= H2017.lower) & (wanted <= H2017.upper)).all(axis=1)]
        wanted = wanted[native.is_free(H2017.native, FREE.native, wanted)]
        found = solve_pose(H2017, pose, seed)
        assert len(found) == len(wanted)
        for solution in wanted:
            assert np.abs(found - solution).max(axis=1).min() < 1e-5
        count += len(wanted)
    assert count > 150


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), robot=st.sampled_from([*robot_names(), "seven", "scara"]))
def test_every_solution_meets_its_target_within_limits_and_free(seed, robot, robot_folders):
    robot = load_robot(robot_folders.get(robot, robot))
    rng = np.random.default_rng(seed)
    pose = random_pose(robot, rng)
    found = solve_pose(robot, pose, seed)
    assert np.array_equal(found, solve_pose(robot, pose, seed))
    if len(found):
        assert max(tool_error(robot, found, pose)) < 1e-6
        assert ((found >= robot.lower) & (found <= robot.upper)).all()
        assert native.is_free(robot.native, FREE.native, found).all()
        assert found.tolist() == sorted(found.tolist())


@pytest.mark.parametrize("name", [*robot_names(), "seven"])
def test_a_position_alone_gives_spread_out_representatives(name, robot_folders):
    robot = load_robot(robot_folders.get(name, name))
    position = native.fk(robot.native, robot.home[None])[0, :3, 3]
    found = solve_ik(robot, FREE, position, None, np.random.default_rng(0), separation=1.0)
    poses = native.fk(robot.native, found)
    assert len(found) >= 8
    assert np.linalg.norm(poses[:, :3, 3] - position, axis=1).max() < 1e-6
    apart = np.abs(found[:, None] - found[None]).max(axis=2) + 10 * np.eye(len(found))
    assert apart.min() >= 1.0


def test_a_stretched_wrist_gives_representatives_of_its_continuum():
    pose = native.fk(H2017.native, np.array([[0.3, 0.5, 1.0, 0.4, 0.0, 0.2]]))[0]
    found = solve_pose(H2017, pose, separation=0.8)
    assert 2 <= len(found) <= 40
    assert max(tool_error(H2017, found, pose)) < 1e-6


def test_whole_turns_within_the_limits_are_solutions_of_their_own(robot_folders):
    robot = load_robot(robot_folders["scara"])
    q = np.array([0.4, 0.9, 0.1, 1.0])
    found = solve_pose(robot, native.fk(robot.native, q[None])[0])
    turned = q - [0, 0, 0, 2 * np.pi]
    for solution in (q, turned):
        assert np.abs(found - solution).max(axis=1).min() < 1e-6
    assert len(found) == 4  # two elbows, two turns of the hand


def test_a_target_out_of_reach_has_no_solution():
    found = solve_ik(H2017, FREE, np.array([3.0, 0, 1]), np.eye(3), np.random.default_rng(0))
    assert found.shape == (0, 6)


def test_solutions_that_collide_with_the_scene_are_left_out():
    table = load_scene("table")
    inside = np.array([0.85, 0.0, 0.62])
    down = np.diag([-1.0, 1.0, -1.0])
    rng = np.random.default_rng(0)
    assert len(solve_ik(H2017, FREE, inside, down, rng)) > 0
    assert len(solve_ik(H2017, table, inside, down, rng)) == 0
