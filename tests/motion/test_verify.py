from __future__ import annotations

import shutil
from dataclasses import replace

import numpy as np
import pytest

from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.robots import load_robot, load_scene
from plancurate.robots.scene import native_scene
from plancurate.tasks.candidates.payload import Payload
from plancurate.tasks.candidates.settings import VerifySettings
from plancurate.tasks.motion.motion import Motion
from plancurate.tasks.motion.settings import MotionSettings
from plancurate.tasks.motion.verify import verify_motion

from .motions import DT, edge_through_an_obstacle, faster, pool, sampled, smooth, world

TURN = np.array([0.5, 0, 0, 0, 0, 0.5])


def checks(verdict):
    return {violation.check for violation in verdict.violations}


def clean(scene="free"):
    robot, loaded = world(scene)
    motion = smooth(robot, robot.home + TURN, 2.0)
    assert verify_motion(robot, loaded, motion).passed
    return robot, loaded, motion


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["free", "table"])
def test_no_candidate_of_a_pool_is_refused_and_each_is_when_a_third_faster(scene, record_property):
    motions = pool(scene)
    assert len(motions) >= 25
    for motion in motions:
        verdict = verify_motion(*world(scene), motion)
        assert verdict.passed, verdict.text
        fast = verify_motion(*world(scene), faster(motion, 1.3))
        assert checks(fast) & {"velocity", "acceleration"}, fast.text
    record_property("clean motions", len(motions))


def test_a_joint_beyond_its_range_is_found_with_its_limit():
    robot, scene = world("free")
    goal = robot.home.copy()
    goal[0] = robot.upper[0] + 0.05
    verdict = verify_motion(robot, scene, smooth(robot, goal, 8.0))
    assert [(v.check, v.where) for v in verdict.violations] == [("position", "joint_1")]
    assert verdict.first.worst == pytest.approx(goal[0])
    assert verdict.first.limit == robot.upper[0]
    assert 7 < verdict.first.time_s < 8


def test_a_range_that_is_left_between_two_samples_is_found():
    robot, scene = world("free")
    motion = smooth(robot, np.array([robot.upper[0] - 0.001, *robot.home[1:]]), 8.0)
    velocities = np.gradient(motion.positions, motion.times, axis=0)
    velocities[[0, -1]] = 0
    velocities[-1, 0] = -0.5  # so that the cubic goes past the end and comes back
    verdict = verify_motion(robot, scene, replace(motion, velocities=velocities))
    found = next(v for v in verdict.violations if v.check == "position")
    assert motion.positions.max() < robot.upper[0] < found.worst
    assert motion.times[-2] < found.time_s < motion.times[-1]


def test_a_velocity_above_its_limit_is_found_and_says_by_how_much():
    robot, scene = world("free")
    duration = 1.875 * 1.5 / robot.velocity[0] / 1.15
    gentle = replace(robot, acceleration=robot.acceleration * 9)
    verdict = verify_motion(gentle, scene, smooth(robot, robot.home + 1.5 * np.eye(6)[0], duration))
    assert [(v.check, v.where) for v in verdict.violations] == [("velocity", "joint_1")]
    assert verdict.first.worst / verdict.first.limit == pytest.approx(1.15, abs=0.05)
    assert verdict.measured["velocity share"] == pytest.approx(1.15, abs=0.05)


def test_an_acceleration_above_its_limit_is_found_though_velocities_are_low():
    robot, scene, motion = clean()
    q = motion.positions.copy()
    q[20:, 5] += 0.02
    verdict = verify_motion(robot, scene, replace(motion, positions=q))
    assert [(v.check, v.where) for v in verdict.violations] == [("acceleration", "joint_6")]
    assert verdict.first.time_s == pytest.approx(motion.times[19], abs=2 * DT)


def test_jerk_is_judged_where_the_robot_has_a_limit_and_else_said_not_to_be(tmp_path):
    robot, scene, motion = clean()
    assert "jerk of joint_1" in verify_motion(robot, scene, motion).not_checked[0]
    folder = tmp_path / "limited"
    shutil.copytree(robot.urdf.parent, folder)
    file = folder / "robot.yaml"
    jerk = 60 * 0.5 / 2.0**3  # of the quintic at both ends, the largest
    file.write_text(
        file.read_text().replace("acceleration: 1.7453,", f"acceleration: 1.7453, jerk: {jerk / 2},", 1)
    )
    verdict = verify_motion(load_robot(folder), scene, motion)
    assert [(v.check, v.where) for v in verdict.violations] == [("jerk", "joint_1")]
    assert verdict.first.worst == pytest.approx(jerk, rel=0.25)
    assert "joint_1" not in verdict.not_checked[0]
    file.write_text(file.read_text().replace(f"jerk: {jerk / 2}", f"jerk: {jerk * 1.3}", 1))
    assert verify_motion(load_robot(folder), scene, motion).passed


def test_links_that_run_into_each_other_are_found_and_named(robot_folders):
    robot, scene = load_robot(robot_folders["seven"]), load_scene("free")
    goal = robot.home + np.array([0, 0, 0, -1.75, 0, 0.9, 0])
    verdict = verify_motion(robot, scene, smooth(robot, goal, 4.0))
    first = next(v for v in verdict.violations if v.check == "self-collision")
    assert first.where.startswith("link_")
    assert first.worst > 0.001
    assert "contact" in checks(verdict)


def test_links_that_meet_while_others_lie_on_the_floor_are_found_too(robot_folders):
    robot = load_robot(robot_folders["seven"])
    goal = robot.home + np.array([0, 0, 0, -1.75, 0, 0.9, 0])
    motion = smooth(robot, goal, 4.0)
    tool = native.joint_frames(robot.native, motion.positions)[:, :, 2, 3].min()
    flooded = replace(load_scene("free"), ground=float(tool))
    flooded = replace(flooded, native=native_scene((), flooded.ground, flooded.margin))
    found = verify_motion(robot, flooded, motion)
    assert {"self-collision", "scene collision"} <= checks(found)
    own = next(v for v in found.violations if v.check == "self-collision")
    dry = next(
        v for v in verify_motion(robot, load_scene("free"), motion).violations if v.check == "self-collision"
    )
    assert (own.where, own.time_s) == (dry.where, dry.time_s)


def test_an_obstacle_is_found_and_named_with_the_depth():
    robot, scene = world("table")
    goal = robot.home + np.array([0, 0.2, 0.9, 0, -0.4, 0])
    verdict = verify_motion(robot, scene, smooth(robot, goal, 3.0))
    assert verdict.first.check == "scene collision"
    assert verdict.first.where == "link_6 and table"
    assert verdict.first.worst > 0.01


def test_a_collision_between_two_free_samples_is_found():
    robot, scene = world("table")
    a, b = edge_through_an_obstacle(robot, scene)
    motion = Motion(np.array([0.0, 1.0]), np.stack([a, b]), joint_names=robot.joint_names)
    assert native.is_free(robot.native, scene.native, motion.positions).all()
    first = next(v for v in verify_motion(robot, scene, motion).violations if v.check == "scene collision")
    assert 0 < first.time_s < 1


def test_clearance_is_measured_and_refused_where_more_is_wanted():
    robot, scene, motion = clean("table")
    least = verify_motion(robot, scene, motion).measured["least clearance m"]
    verdict = verify_motion(robot, scene, motion, MotionSettings(min_clearance_m=least + 0.01))
    assert [(v.check, v.worst) for v in verdict.violations] == [("clearance", least)]
    assert verify_motion(robot, scene, motion, MotionSettings(min_clearance_m=least - 0.01)).passed


def test_a_payload_that_is_too_heavy_is_found_in_torque_and_in_playback():
    robot, scene, motion = clean()
    assert verify_motion(robot, scene, motion, payload=Payload(mass_kg=10)).passed
    verdict = verify_motion(robot, scene, motion, payload=Payload(mass_kg=60, centre_m=(0, 0, 0.1)))
    assert verdict.first.check == "torque"
    assert verdict.first.where in ("joint_2", "joint_3")
    assert "tracking" in checks(verdict)


def test_a_payload_counts_at_its_centre():
    robot, scene, motion = clean()
    near = verify_motion(robot, scene, motion, payload=Payload(mass_kg=10))
    far = verify_motion(robot, scene, motion, payload=Payload(mass_kg=10, centre_m=(0.5, 0, 0)))
    assert far.measured["torque share"] > near.measured["torque share"] + 0.05


def test_a_motion_that_the_drives_can_t_follow_is_found():
    robot, scene, motion = clean()
    settings = MotionSettings(playback=VerifySettings(max_tracking_error_rad=1e-6))
    verdict = verify_motion(robot, scene, motion, settings)
    assert checks(verdict) == {"tracking"}
    weak = replace(robot, effort=robot.effort * 0.15)
    assert {"torque", "tracking", "saturation"} <= checks(verify_motion(weak, scene, motion))


def test_joints_in_another_order_are_found_by_their_names_and_at_home_without():
    robot, scene, motion = clean()
    order = [0, 2, 1, 3, 4, 5]
    names = tuple(np.array(robot.joint_names)[order])
    named = verify_motion(
        robot, scene, replace(motion, positions=motion.positions[:, order], joint_names=names)
    )
    assert [v.check for v in named.violations] == ["joint order"]
    assert "joint_1, joint_3, joint_2" in named.first.message
    bare = replace(motion, positions=motion.positions[:, order], joint_names=None)
    unnamed = verify_motion(robot, scene, bare)
    assert [v.check for v in unnamed.violations] == ["joint order"]
    assert unnamed.first.where == "joint_2, joint_3"
    right = verify_motion(robot, scene, replace(motion, joint_names=None))
    assert right.passed
    assert any("names" in said for said in right.not_checked)


def test_values_that_are_no_numbers_are_found_with_joint_and_sample():
    robot, scene, motion = clean()
    for value in (np.nan, np.inf):
        q = motion.positions.copy()
        q[7, 2] = value
        verdict = verify_motion(robot, scene, replace(motion, positions=q))
        assert [(v.check, v.where) for v in verdict.violations] == [("finite", "joint_3")]
        assert verdict.first.time_s == motion.times[7]
        assert "sample 7" in verdict.first.message
    times = motion.times.copy()
    times[3] = np.nan
    assert verify_motion(robot, scene, replace(motion, times=times)).first.check == "finite"


@pytest.mark.parametrize("exchanged", [[5, 4], [5, 5]])
def test_times_that_go_back_or_stand_still_are_found(exchanged):
    robot, scene, motion = clean()
    times = motion.times.copy()
    times[[4, 5]] = times[exchanged]
    verdict = verify_motion(robot, scene, replace(motion, times=times))
    assert [v.check for v in verdict.violations] == ["times"]


def test_other_shapes_are_violations_and_too_long_a_motion_an_error():
    robot, scene, motion = clean()
    few = Motion(motion.times, motion.positions[:, :5])
    assert "6 joints" in verify_motion(robot, scene, few).first.message
    assert verify_motion(robot, scene, Motion(motion.times[:1], motion.positions[:1])).first.check == "shape"
    with pytest.raises(PlancurateError, match="at most 3600 s"):
        verify_motion(robot, scene, replace(motion, times=motion.times * 1e4))


def test_the_first_violation_is_the_earliest_and_all_are_listed():
    robot, scene, motion = clean()
    q = motion.positions.copy()
    q[30:, 5] += 0.1
    q[10:, 3] += 0.1
    verdict = verify_motion(robot, scene, replace(motion, positions=q))
    assert verdict.first.where == "joint_4"
    assert {v.where for v in verdict.violations} >= {"joint_4", "joint_6"}
    assert [v.time_s for v in verdict.violations] == sorted(v.time_s for v in verdict.violations)
    assert verdict.text.splitlines()[0].startswith("FAIL: joint_4 exceeds its")


def test_velocities_given_rule_what_happens_between_samples():
    robot, scene, motion = clean()
    t = motion.times[::8]
    s = (t / 2)[:, None]
    exact = (30 * s**2 - 60 * s**3 + 30 * s**4) / 2 * TURN
    coarse = Motion(t, motion.positions[::8], exact, joint_names=robot.joint_names)
    assert verify_motion(robot, scene, coarse).passed
    wild = exact.copy()
    wild[2, 5] += 2
    assert checks(verify_motion(robot, scene, replace(coarse, velocities=wild))) >= {"acceleration"}


def test_every_robot_folder_passes_a_slow_motion(robot_folders):
    for name in ("seven", "scara"):
        robot, scene = load_robot(robot_folders[name]), load_scene("free")
        goal = robot.home + 0.1 * (robot.upper - robot.home)
        verdict = verify_motion(robot, scene, smooth(robot, goal, 3.0))
        assert verdict.passed, verdict.text


def test_a_sampled_pool_motion_is_the_same_from_its_positions_alone():
    robot, scene = world("free")
    motion = pool("free")[0]
    again = verify_motion(robot, scene, sampled(robot, motion.positions))
    assert again == verify_motion(robot, scene, motion)
