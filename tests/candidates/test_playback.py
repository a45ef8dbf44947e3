import re
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from plancurate import native
from plancurate.robots import load_robot, load_scene, load_world, robot_names, scene_names
from plancurate.robots.urdf import read_urdf
from plancurate.tasks.candidates.bullet import bullet
from plancurate.tasks.candidates.payload import Payload
from plancurate.tasks.candidates.playback import play, verify
from plancurate.tasks.candidates.settings import VerifySettings
from plancurate.tasks.candidates.simulation import World

DT = 0.05
SETTINGS = VerifySettings()


def smooth_motion(robot, goal):
    """Waypoints from home to `goal` whose speed and acceleration peak at the robot's limits."""
    distance = np.abs(goal - robot.home)
    duration = max(
        (1.875 * distance / robot.velocity).max(), np.sqrt(5.78 * distance / robot.acceleration).max(), 0.5
    )
    s = np.linspace(0, 1, int(np.ceil(duration / DT)) + 1)[:, None]
    return robot.home + (10 * s**3 - 15 * s**4 + 6 * s**5) * (goal - robot.home)


def some_goals(robot, count):
    return np.random.default_rng(3).uniform(robot.lower, robot.upper, (count, robot.dof)) * 0.5


@pytest.mark.slow
@pytest.mark.parametrize("name", robot_names())
@pytest.mark.parametrize("scene", scene_names())
def test_every_robot_of_the_package_holds_its_home(name, scene):
    robot, scene = load_world(name, scene)
    found = verify(robot, scene, np.repeat(robot.home[None], 20, axis=0), DT, SETTINGS)
    assert found.verified, found.reason
    assert found.max_tracking_error_rad < 1e-3


@pytest.mark.parametrize("name", robot_names())
def test_no_link_that_weighs_anything_turns_without_resistance(name):
    robot, world = load_robot(name), World()
    world.build_alone(robot)
    for _, link in world.names:
        mass, _, moments, *_ = bullet.getDynamicsInfo(world.body, link, physicsClientId=world.client)
        assert mass == 0 or min(moments) > 0  # PyBullet takes zero for an inertia that no body can have


@pytest.mark.parametrize("name", [*robot_names(), "seven", "scara"])
def test_motions_within_the_limits_are_followed_closely(name, robot_folders):
    robot, scene = load_robot(robot_folders.get(name, name)), load_scene("free")
    for goal in some_goals(robot, 4):
        path = smooth_motion(robot, np.clip(goal, robot.lower, robot.upper))
        if not native.is_free(robot.native, scene.native, path).all():
            continue
        found = verify(robot, scene, path, DT, SETTINGS)
        assert found.verified, found.reason
        assert found.reason == ""
        assert found.contacts == 0
        assert found.max_tracking_error_rad < 0.02
        assert found.final_tracking_error_m < 1e-3


@pytest.mark.slow
def test_the_numbers_do_not_depend_on_what_was_played_before_or_beside():
    robot, scenes = load_robot("h2017"), [load_scene("free"), load_scene("table")]
    goals = [*some_goals(robot, 3), robot.home + np.array([0, 0.2, 0.9, 0, -0.4, 0])]
    paths = [smooth_motion(robot, goal) for goal in goals]
    jobs = [(scene, path) for scene in scenes for path in paths]
    alone = [verify(robot, scene, path, DT, SETTINGS) for scene, path in jobs]
    assert any(found.contacts for found in alone)  # a contact is what would leave traces
    shuffled = np.random.default_rng(0).permutation(np.repeat(np.arange(len(jobs)), 3))
    with ThreadPoolExecutor(3) as pool:
        again = list(pool.map(lambda i: verify(robot, *jobs[i], DT, SETTINGS), shuffled))
    assert again == [alone[i] for i in shuffled]


def test_a_motion_into_the_table_is_refused_and_the_contact_named():
    robot, scene = load_robot("h2017"), load_scene("table")
    path = smooth_motion(robot, robot.home + np.array([0, 0.2, 0.9, 0, -0.4, 0]))
    found = verify(robot, scene, path, DT, SETTINGS)
    assert not found.verified
    assert found.contacts > 0
    assert "link_6 touches table after" in found.reason


def test_a_motion_into_the_floor_is_refused():
    robot = load_robot("h2017")
    path = smooth_motion(robot, np.array([0, 1.6, 1.2, 0, 0.3, 0]))
    assert "touches ground" in verify(robot, load_scene("free"), path, DT, SETTINGS).reason


def test_links_that_run_into_each_other_are_refused(robot_folders):
    robot = load_robot(robot_folders["seven"])
    path = smooth_motion(robot, robot.home + np.array([0, 0, 0, -1.75, 0, 0.9, 0]))
    reason = verify(robot, load_scene("free"), path, DT, SETTINGS).reason
    assert "link_" in reason
    assert "touches" in reason
    assert "ground" not in reason


def with_effort(folder, tmp_path, effort):
    copy = tmp_path / "weak"
    shutil.copytree(folder, copy)
    file = copy / "robot.urdf"
    file.write_text(file.read_text().replace('effort="372"', f'effort="{effort}"'))
    return load_robot(copy)


def test_a_robot_too_weak_for_gravity_is_refused(tmp_path):
    robot = with_effort(load_robot("h2017").urdf.parent, tmp_path, 60)
    found = verify(robot, load_scene("free"), np.repeat(robot.home[None], 20, axis=0), DT, SETTINGS)
    assert not found.verified
    assert "tracking error" in found.reason
    assert found.saturated_share > 0.1


def test_a_payload_enters_playback():
    robot = load_robot("h2017")
    path = smooth_motion(robot, robot.home + np.array([0, 0.3, 0, 0.4, 0, 0]))
    alone, heavy, far = (
        verify(robot, load_scene("free"), path, DT, VerifySettings(**carried))
        for carried in (
            {"payload_centre_m": (0, 0, 2)},
            {"payload_mass_kg": 10},
            {"payload_mass_kg": 10, "payload_centre_m": (2, 0, 0)},
        )
    )
    assert alone == verify(robot, load_scene("free"), path, DT, SETTINGS)
    assert heavy.verified
    assert heavy.max_tracking_error_rad != alone.max_tracking_error_rad
    assert far.saturated_share > heavy.saturated_share
    assert not far.verified


def test_without_a_payload_settings_are_written_as_before_there_was_one():
    assert "payload" not in VerifySettings(payload_centre_m=(0, 0, 1)).model_dump_json()
    carried = VerifySettings(payload_mass_kg=2, payload_centre_m=(0, 0, 0.1))
    assert VerifySettings.model_validate_json(carried.model_dump_json()) == carried
    assert carried.payload == Payload(mass_kg=2, centre_m=(0, 0, 0.1))
    assert SETTINGS.payload is None


def test_saturation_alone_is_refused_when_asked_for(tmp_path):
    robot = with_effort(load_robot("h2017").urdf.parent, tmp_path, 200)
    path = smooth_motion(robot, np.array([1.0, 0.6, 1.0, 0.5, 1.0, 0.0]))
    loose = VerifySettings(max_tracking_error_rad=9, max_final_error_m=9, max_saturated_share=0.0)
    found = verify(robot, load_scene("free"), path, DT, loose)
    assert "effort limit" in found.reason
    assert not verify(robot, load_scene("free"), path, DT, SETTINGS).verified


def test_a_motion_faster_than_the_limits_is_refused_and_the_joint_named():
    robot, scene = load_robot("h2017"), load_scene("free")
    path = smooth_motion(robot, robot.home + np.array([0, 0, 0, 0.8, 0, 0]))
    assert verify(robot, scene, path, DT, SETTINGS).verified
    twice = verify(robot, scene, path, DT / 2, SETTINGS)
    assert not twice.verified
    assert re.fullmatch(
        r"joint_4 exceeds its acceleration limit [34]\.\d\d times after 0\.\d\d s", twice.reason
    )
    steady = robot.home + np.arange(40)[:, None] * np.array([0, 0, 0, 0, 0, 0.005])
    assert (
        "joint_6 exceeds its velocity limit 1.27 times"
        in verify(robot, scene, steady, 0.00125, SETTINGS).reason
    )


def test_a_motion_beyond_a_joint_s_range_is_refused_and_the_joint_named():
    robot, scene = load_robot("h2017"), load_scene("free")
    beyond = robot.home + np.array([robot.upper[0] + 0.02, 0, 0, 0, 0, 0])  # its URDF allows twice as much
    reason = verify(robot, scene, smooth_motion(robot, beyond), DT, SETTINGS).reason
    assert reason.startswith("joint_1 leaves its position limits by 0.02 at sample")


@pytest.mark.parametrize("name", [*robot_names(), "seven", "scara"])
def test_the_drives_carry_exactly_the_weight_in_the_urdf(name, robot_folders):
    robot = load_robot(robot_folders.get(name, name))
    played = play(robot, load_scene("free"), np.repeat(robot.home[None], 40, axis=0), DT, SETTINGS)
    np.testing.assert_allclose(played.torque[-1], gravity_torque(robot), rtol=0.005, atol=0.02)


def gravity_torque(robot):
    """Slope of the potential energy at home, from the URDF's masses and our kinematics."""
    centres = read_centres(robot)

    def energy(q):
        frames = native.joint_frames(robot.native, q[None])[0]
        return sum(9.81 * mass * (frames[frame - 1] @ centre)[2] for frame, centre, mass in centres)

    steps = 1e-5 * np.eye(robot.dof)
    return np.array([(energy(robot.home + s) - energy(robot.home - s)) / 2e-5 for s in steps])


def read_centres(robot):
    """(moving frame, centre of mass there, mass) of every moving link."""
    import xml.etree.ElementTree as ET

    masses = {name: link.mass for name, link in read_urdf(robot.urdf).links.items() if link.mass}
    found = []
    for element in ET.parse(robot.urdf).findall("link"):
        place = robot.chain.placements[element.get("name")]
        if element.get("name") in masses and place.frame > 0:
            origin = element.find("inertial/origin")
            centre = np.array([*map(float, origin.get("xyz").split()), 1.0])
            found.append((place.frame, place.pose @ centre, masses[element.get("name")]))
    return found


def test_waypoints_of_a_wrong_shape_are_an_error():
    robot, scene = load_robot("h2017"), load_scene("free")
    for shape in [(6,), (5, 5), (1, 6)]:
        with pytest.raises(ValueError, match="shape"):
            verify(robot, scene, np.zeros(shape), DT, SETTINGS)


@pytest.mark.slow
def test_nothing_is_written_to_the_terminal(robot_folders):
    program = f"""
import numpy as np
from plancurate.robots import load_robot, load_scene
from plancurate.tasks.candidates.playback import verify
from plancurate.tasks.candidates.settings import VerifySettings
robot = load_robot({str(robot_folders["seven"])!r})
assert verify(robot, load_scene("table"), np.repeat(robot.home[None], 5, axis=0), 0.05, VerifySettings())
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
