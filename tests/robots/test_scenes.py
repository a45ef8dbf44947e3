from pathlib import Path

import numpy as np
import pytest

from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.robots import colliding_pairs, load_robot, load_scene, load_world, robot_names, scene_names
from plancurate.robots.clutter import ClutterParameters, parse_clutter

H2017 = load_robot("h2017")
BOX = "shapes: [{name: box, kind: box, size: [0.2, 0.1, 0.4], xyz: [0.5, -0.2, 0.1]}]\n"


def write(folder: Path, text: str) -> Path:
    file = folder / "mine.yaml"
    file.write_text(text)
    return file


def test_lengths_in_reach_grow_with_the_robot_and_start_at_its_shoulder(tmp_path, robot_folders):
    file = write(
        tmp_path, f"ground: 0.0\nscale: reach\nregions: {{r: {{min: [0, 0, 0], max: [1, 1, 1]}}}}\n{BOX}"
    )
    for robot in (H2017, load_robot(robot_folders["seven"])):
        scene = load_scene(file, robot)
        (box,), (region,) = scene.shapes, scene.regions
        np.testing.assert_allclose(box.shape.size, np.array([0.1, 0.05, 0.2]) * robot.reach)
        np.testing.assert_allclose(
            box.shape.pose[:3, 3], robot.shoulder + np.array([0.5, -0.2, 0.1]) * robot.reach
        )
        np.testing.assert_allclose(region.upper - region.lower, robot.reach)
        assert scene.ground == 0
        assert scene.margin == 0.005
    with pytest.raises(PlancurateError, match=r"mine\.yaml: is sized for a robot"):
        load_scene(file)


def test_the_reach_is_that_of_the_stretched_arm():
    assert H2017.reach == 1.7  # 0.845 + 0.734 + 0.121
    assert H2017.shoulder.tolist() == [0, 0, 0.34]


def test_the_digest_stands_for_what_happens_in_the_scene(tmp_path, robot_folders):
    plain = load_scene(write(tmp_path, f"ground: 0.0\n{BOX}"))
    assert load_scene(write(tmp_path, f"# a note\n{BOX}ground: 0\nmargin: 0.005\n")).digest == plain.digest
    region = "regions: {r: {min: [0, 0, 0], max: [1, 1, 1]}}\n"
    for text in (
        f"ground: 0.001\n{BOX}",
        f"ground: null\n{BOX}",
        f"ground: 0\nmargin: 0.006\n{BOX}",
        f"ground: 0\n{BOX}".replace("0.1]", "0.1001]"),
        f"ground: 0\n{BOX}".replace("box, size", "box, rpy: [0, 0, 0.001], size"),
        f"ground: 0\n{BOX}{region}",
        f"ground: 0\ntool_axis: [1, 0, 0]\n{BOX}",
        f"ground: 0\nstart: [0, 0, 1.5, 0, 1.5, 0.1]\n{BOX}",
    ):
        assert load_scene(write(tmp_path, text), H2017).digest != plain.digest
    seven = load_robot(robot_folders["seven"])
    assert load_scene("shelf", seven).digest != load_scene("shelf", H2017).digest


def test_a_named_start_is_where_the_robot_begins(tmp_path):
    start = [0.1, -0.2, 1.5, 0, 1.4, 0]
    for text in (f"start: {start}", f"start: {{h2017: {start}, other: [0]}}"):
        robot, scene = load_world("h2017", write(tmp_path, f"ground: 0\n{text}\n"))
        assert robot.home.tolist() == scene.start.tolist() == start
    robot, scene = load_world("h2017", write(tmp_path, "ground: 0\nstart: {other: [0]}\n"))
    assert scene.start is None
    assert robot.home.tolist() == H2017.home.tolist()


@pytest.mark.slow
@pytest.mark.parametrize("robot", robot_names())
@pytest.mark.parametrize("name", scene_names())
def test_the_start_is_free_with_room_to_spare_in_every_scene(robot, name):
    robot, scene = load_world(robot, name)
    assert colliding_pairs(robot, scene, robot.home) == []
    assert native.clearance(robot.native, scene.native, robot.home[None])[0] > 0.01 * robot.reach


@pytest.mark.slow
@pytest.mark.parametrize("name", ["shelf", "passage"])
@pytest.mark.parametrize("folder", [*robot_names(), "seven"])
def test_a_start_tool_brings_the_tool_there_pointing_along_the_axis(name, folder, robot_folders):
    robot, scene = load_world(robot_folders.get(folder, folder), name)
    tool = native.fk(robot.native, robot.home[None])[0]
    wanted = {"shelf": [0.33, 0, 0.34], "passage": [0.3, 0, 0.55]}[name]
    np.testing.assert_allclose(tool[:3, 3], robot.shoulder + robot.reach * np.array(wanted), atol=1e-5)
    np.testing.assert_allclose(tool[:3, 2], [1, 0, 0], atol=1e-5)
    assert native.clearance(robot.native_without_pairs, scene.native, robot.home[None])[0] > 0.03


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("start: [0, 0]", "start: 2 joint positions; robot h2017 has 6 joints"),
        ("start: [0, 0, 0, 0, 9, 0]", r"start: joint_5=9 must lie within \[-2\.3562, 2\.3562\]"),
        ("start: [0, 1.5, 2.2, 0, 0, 0]", r"start: collides \(.*ground"),
        ("start_tool: [9, 0, 0]", r"start_tool: robot h2017 can't bring its tool to \[9\.0, 0\.0, 0\.0\] m"),
        ("tool_axis: [0, 0, 0]", "has no direction"),
        ("regions: {r: {min: [0, 0, 0], max: [1, 0, 1]}}", r"regions\.r = .*min must be below"),
        ("scale: feet", "scale = .*'metres' or 'reach'"),
        (
            "shapes: [{name: crate, kind: box, size: [0.1, 0.1, 0.1], xyz: [0.1, 0, 0.1]}]",
            "shapes: base_link and crate touch wherever the arm is",
        ),
    ],
)
def test_what_a_scene_can_t_mean_is_an_error_that_names_the_field(text, message, tmp_path):
    with pytest.raises(PlancurateError, match=message) as raised:
        load_scene(write(tmp_path, f"ground: 0\n{text}\n"), H2017)
    assert "mine.yaml" in str(raised.value)


def test_grown_obstacles_keep_what_is_free_away_from_the_first_ones(tmp_path):
    shapes = [
        "{name: box, kind: box, size: [0.3, 0.2, 0.1], xyz: [0.6, 0.3, 1.0], rpy: [0.3, 0.2, 0.1]}",
        "{name: ball, kind: sphere, radius: 0.1, xyz: [0.5, -0.4, 0.9]}",
        "{name: can, kind: cylinder, radius: 0.08, length: 0.4, xyz: [0.9, 0.0, 0.5], rpy: [1.2, 0, 0]}",
        "{name: bar, kind: capsule, radius: 0.05, length: 0.4, xyz: [0.2, 0.5, 1.5], rpy: [0, 1, 0]}",
    ]
    scene = load_scene(write(tmp_path, f"ground: 0\nshapes: [{', '.join(shapes)}]\n"))
    q = np.random.default_rng(0).uniform(H2017.lower, H2017.upper, (20_000, 6))
    clear = native.clearance(H2017.native_without_pairs, scene.native, q)
    allowed = native.is_free(H2017.native_without_pairs, scene.grown(0.05).native, q)
    assert clear[allowed].min() > 0.05
    assert (allowed & (clear < 0.07)).sum() > 100  # and not much more than that
    assert scene.grown(0.0) is scene


def test_clutter_repeats_and_other_seeds_numbers_and_sizes_are_other_scenes():
    scenes = [
        load_scene(name, H2017) for name in ("clutter", "clutter:1", "clutter:1:20", "clutter:1:20:0.03")
    ]
    sizes = ["0-12-0.06", "1-12-0.06", "1-20-0.06", "1-20-0.03"]
    assert [scene.name for scene in scenes] == [f"clutter-{size}" for size in sizes]
    assert [len(scene.shapes) for scene in scenes] == [12, 12, 20, 20]
    assert len({scene.digest for scene in scenes}) == 4
    assert load_scene("clutter:1:12:0.06", H2017).digest == scenes[1].digest
    sizes = [np.mean([max(entry.shape.size) for entry in scene.shapes]) for scene in scenes]
    assert sizes[3] == pytest.approx(sizes[2] / 2)


def test_clutter_leaves_room_around_the_start():
    for seed in range(5):
        scene = load_scene(f"clutter:{seed}:30", H2017)
        assert native.clearance(H2017.native_without_pairs, scene.native, H2017.home[None])[0] > 0.04 * 1.7


@pytest.mark.parametrize("rest", [":", ":x", ":1:0", ":1:101", ":1:9:0.5", ":-1"])
def test_a_member_of_the_family_that_does_not_exist_is_an_error_that_says_how_to_name_one(rest):
    with pytest.raises(PlancurateError, match=r"such as clutter:7:12:0\.06"):
        load_scene(f"clutter{rest}", H2017)
    assert parse_clutter("clutter:7:12:0.06") == ClutterParameters(7, 12, 0.06)
