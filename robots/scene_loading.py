"""Load a scene from its YAML file, for a robot where it depends on one."""

from __future__ import annotations

import hashlib
import json
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.robots.clutter import CLUTTER, clutter_file, parse_clutter
from plancurate.robots.collisions import obstacles_in_base
from plancurate.robots.files import NAME, read_yaml
from plancurate.robots.loading import load_robot
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene, SceneShape, native_scene
from plancurate.robots.scene_file import METRES, Frame, SceneFile
from plancurate.robots.scene_start import scene_start
from plancurate.robots.shapes import FloatArray

SCENES_FOLDER = Path(__file__).parent / "scenes"
DIGITS = 9  # of a metre or rad that tell scenes apart


def scene_names() -> list[str]:
    """Names of the scenes that come with the package, the family `clutter` by its first member."""
    return sorted([*(file.stem for file in SCENES_FOLDER.glob("*.yaml")), CLUTTER])


def scenes_from_home(robot: Robot) -> list[Scene]:
    """Scenes of the package that a robot starts in from its home, as far as it fits in."""
    found = []
    for file in sorted(SCENES_FOLDER.glob("*.yaml")):
        with suppress(PlancurateError):
            found.append(load_scene(file.stem, robot))
    return [scene for scene in found if scene.start is None]


def load_world(robot: str | Path, scene: str | Path) -> tuple[Robot, Scene]:
    """Load a robot by name or folder and a scene for it; the robot's home is the start that the scene names."""
    loaded = load_robot(robot)
    made = load_scene(scene, loaded)
    return (loaded if made.start is None else replace(loaded, home=made.start)), made


def load_scene(name_or_file: str | Path, robot: Robot | None = None) -> Scene:
    """Load a scene by name or from a YAML file; PlancurateError says what is wrong with it.

    `clutter:SEED`, `clutter:SEED:NUMBER` and `clutter:SEED:NUMBER:SIZE` are members of the family of random scenes.
    A scene that is sized by a robot's reach or names a start needs the robot.
    """
    name = str(name_or_file)
    if name.partition(":")[0] == CLUTTER:
        if robot is None:
            raise PlancurateError(_robot_needed(name))
        parameters = parse_clutter(name)
        return _build(parameters.label, name, clutter_file(parameters, robot), robot)
    file = _scene_file(name_or_file)
    content = read_yaml(file, SceneFile)
    if content.needs_robot and robot is None:
        raise PlancurateError(_robot_needed(name))
    return _build(file.stem, str(file), content, robot)


def _build(name: str, where: str, content: SceneFile, robot: Robot | None) -> Scene:
    frame = METRES if robot is None else _frame(content, robot)
    shapes = tuple(SceneShape(entry.name, entry.to_shape(frame)) for entry in content.shapes)
    regions = tuple(entry.to_region(name, frame) for name, entry in content.regions.items())
    axis = None if content.tool_axis is None else _unit(np.array(content.tool_axis))
    model = native_scene(shapes, content.ground, content.margin)
    scene = Scene(name, shapes, content.ground, content.margin, model, "", regions, axis)
    if robot is not None and (found := obstacles_in_base(robot, scene)):
        raise PlancurateError(
            f"{where}: shapes: {', '.join(found)} touch wherever the arm is; move the shape off the base, or lower it "
            "below what the arm stands on"
        )
    start = None if robot is None else scene_start(where, content, frame, robot, scene)
    started = replace(scene, start=start)
    return replace(started, digest=_digest(started))


def _frame(content: SceneFile, robot: Robot) -> Frame:
    if content.sized_for is not None:
        return content.sized_for.frame(robot.reach, robot.shoulder)
    return Frame(robot.reach, robot.shoulder) if content.scale == "reach" else METRES


def _digest(scene: Scene) -> str:
    """Hash of all that decides what happens in the scene; comments, order of fields and units don't."""
    content = [
        [
            [entry.name, entry.shape.kind, _rounded(entry.shape.size), _rounded(entry.shape.pose)]
            for entry in scene.shapes
        ],
        [[region.name, _rounded(region.lower), _rounded(region.upper)] for region in scene.regions],
        [scene.ground, scene.margin],
        [None if vector is None else _rounded(vector) for vector in (scene.tool_axis, scene.start)],
    ]
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()[:12]


def _rounded(values: FloatArray | tuple[float, ...]) -> list[float]:
    return [float(value) + 0.0 for value in np.round(np.asarray(values, dtype=float).ravel(), DIGITS)]


def _unit(vector: FloatArray) -> FloatArray:
    return np.asarray(vector / np.linalg.norm(vector))


def _robot_needed(name: str) -> str:
    return f"scene {name}: is sized for a robot or names its start; load it with the robot, load_scene(name, robot)"


def _scene_file(name_or_file: str | Path) -> Path:
    shipped = SCENES_FOLDER / f"{name_or_file}.yaml"
    if str(name_or_file) in scene_names() and shipped.is_file():
        return shipped
    file = Path(name_or_file)
    if not file.is_file():
        if isinstance(name_or_file, Path) or len(file.parts) > 1 or file.suffix:
            raise PlancurateError(
                f"{file}: no such file; a scene is a YAML file with ground, margin and shapes"
            )
        raise UnknownNameError("scene", name_or_file, scene_names())
    if not NAME.fullmatch(file.stem):
        raise PlancurateError(f"{file}: a scene file's name may hold letters, digits, '_', '.' and '-' only")
    return file
