import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from plancurate import native
from plancurate.robots import load_robot, load_scene, robot_names

TOLERANCE = 1e-3  # m; PyBullet may call a touch what lies within
KINDS = ("box", "sphere", "capsule", "cylinder")


def random_scene_yaml(seed, margin=0.0):
    rng = np.random.default_rng(seed)
    rows = []
    for index, kind in enumerate(itertools.islice(itertools.cycle(KINDS), 12)):
        direction = rng.normal(size=3)
        xyz = direction / np.linalg.norm(direction) * rng.uniform(0.7, 1.4) + [0, 0, 0.7]
        size = rng.uniform(0.05, 0.3, 3).round(3).tolist()
        solid = {
            "box": f"size: {size}",
            "sphere": f"radius: {size[0]}",
            "capsule": f"radius: {size[0] / 2}, length: {size[1]}",
            "cylinder": f"radius: {size[0] / 2}, length: {size[1]}",
        }[kind]
        rpy = rng.uniform(-3, 3, 3).tolist()
        rows.append(f"  - {{name: s{index}, kind: {kind}, {solid}, xyz: {xyz.tolist()}, rpy: {rpy}}}")
    return f"ground: 0.0\nmargin: {margin}\nshapes:\n" + "\n".join(rows)


@pytest.fixture(scope="module")
def clutter(tmp_path_factory):
    file = tmp_path_factory.mktemp("scenes") / "clutter.yaml"
    file.write_text(random_scene_yaml(seed=5))
    return file


@pytest.fixture
def robot(request, robot_folders):
    return load_robot(robot_folders.get(request.param, request.param))


def states(robot, count, seed=0):
    return np.random.default_rng(seed).uniform(robot.lower, robot.upper, (count, robot.dof))


@pytest.mark.slow
@pytest.mark.parametrize("robot", [*robot_names(), "seven", "scara"], indirect=True)
def test_forward_kinematics_agrees_with_pybullet(robot, judge):
    q = states(robot, 10_000)
    ours = native.fk(robot.native, q)
    theirs = judge(robot, load_scene("free")).tool_poses(q, robot.tool_link)
    assert np.abs(ours[:, :3, 3] - theirs[:, :3]).max() < 1e-6
    apart = Rotation.from_matrix(ours[:, :3, :3]).inv() * Rotation.from_quat(theirs[:, 3:])
    assert apart.magnitude().max() < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize(
    ("robot", "scene", "count"),
    [
        ("h2017", "free", 100_000),
        ("h2017", "table", 100_000),
        ("h2017", "clutter", 100_000),
        ("panda", "clutter", 20_000),
        ("xarm6", "table", 20_000),
        ("seven", "clutter", 20_000),
        ("scara", "clutter", 20_000),
    ],
    indirect=["robot"],
)
def test_no_state_that_pybullet_calls_colliding_is_called_free(
    robot, scene, count, judge, clutter, record_property
):
    scene = load_scene(clutter if scene == "clutter" else scene)
    q = states(robot, count, seed=1)
    free = native.is_free(robot.native, scene.native, q)
    pybullet = judge(robot, scene)
    assert free.sum() > count / 20
    assert pybullet.penetration(q[free]).max() <= TOLERANCE
    refused = q[~free][:3_000]
    needlessly = (pybullet.penetration(refused) == 0.0).mean() * (~free).mean()
    record_property("false_colliding_share", float(needlessly))
    assert needlessly < 0.02


def test_clearance_is_never_more_than_pybullet_measures(judge, clutter):
    robot, scene = load_robot("h2017"), load_scene(clutter)
    q = states(robot, 20_000, seed=2)
    claimed = native.clearance(robot.native, scene.native, q)
    assert not judge(robot, scene).penetration(q[claimed > TOLERANCE]).any()
