from pathlib import Path

import numpy as np

from plancurate import native
from plancurate.robots import load_robot
from plancurate.robots.contacts import checked_pairs

H2017 = load_robot("h2017")


def test_the_flange_of_the_upright_arm_is_where_the_link_lengths_put_it():
    upright = native.fk(H2017.native, np.zeros((1, 6)))[0]
    np.testing.assert_allclose(upright[:3, 3], [0, 0.0099, 0.3443 + 0.845 + 0.734 + 0.121], atol=1e-12)
    np.testing.assert_allclose(upright[:3, :3], np.eye(3), atol=1e-12)


def test_kinematics_agree_with_the_denavit_hartenberg_table():
    theta0 = np.array([0, -1, 1, 0, 0, 0]) * np.pi / 2
    d, a = np.array([0.3443, 0.0099, 0, 0.734, 0, 0.121]), np.array([0, 0.845, 0, 0, 0, 0])
    alpha = np.array([-1, 0, 1, -1, 1, 0]) * np.pi / 2
    for q in np.random.default_rng(0).uniform(H2017.lower, H2017.upper, (100, 6)):
        pose = np.eye(4)
        for theta, d_i, a_i, alpha_i in zip(q + theta0, d, a, alpha, strict=True):
            c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha_i), np.sin(alpha_i)
            pose = pose @ [
                [c, -s * ca, s * sa, a_i * c],
                [s, c * ca, -c * sa, a_i * s],
                [0, sa, ca, d_i],
                [0, 0, 0, 1],
            ]
        np.testing.assert_allclose(native.fk(H2017.native, q[None])[0], pose, atol=1e-12)


def test_exactly_the_five_pairs_of_links_that_can_meet_are_checked():
    indices = checked_pairs(H2017.shapes, H2017.allowed_contacts)
    pairs = {tuple(sorted(H2017.shapes[i].link for i in pair)) for pair in indices}
    assert pairs == {
        ("base_link", "link_4"),
        ("base_link", "link_5"),
        ("base_link", "link_6"),
        ("link_1", "link_4"),
        ("link_2", "link_4"),
    }


def test_planning_limits_lie_within_the_urdf_and_home_in_the_middle_of_them():
    assert (H2017.velocity <= [joint.velocity for joint in H2017.chain.joints]).all()
    assert (H2017.lower >= [joint.lower for joint in H2017.chain.joints]).all()
    np.testing.assert_allclose(H2017.home, np.deg2rad([0, 0, 90, 0, 90, 0]))
    np.testing.assert_allclose(H2017.effort, [372, 372, 372, 163, 96, 50])


def test_the_digest_follows_the_files(tmp_path):
    folder = tmp_path / "h2017"
    folder.mkdir()
    for name in ("robot.urdf", "robot.yaml"):
        (folder / name).write_bytes((Path(H2017.urdf).parent / name).read_bytes())
    assert load_robot(folder).digest == H2017.digest
    with (folder / "robot.yaml").open("a") as file:
        file.write("# changed\n")
    assert load_robot(folder).digest != H2017.digest
