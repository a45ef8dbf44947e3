"""What a scene is: a floor and primitive obstacles from a YAML file."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

from plancurate import native
from plancurate.errors import PlancurateError, UnknownNameError
from plancurate.robots.files import NAME, read_yaml
from plancurate.robots.scene_file import SceneFile
from plancurate.robots.shapes import Shape, shape_arrays

SCENES_FOLDER = Path(__file__).parent / "scenes"


@dataclass(frozen=True, eq=False)
class SceneShape:
    """A named obstacle, posed in the frame of the robot's base."""

    name: str
    shape: Shape


@dataclass(frozen=True, eq=False)
class Scene:
    """Obstacles and the height of the floor (None without one), metres, in the frame of the robot's base."""

    name: str
    shapes: tuple[SceneShape, ...]
    ground: float | None
    margin: float  # clearance in m that a free state has
    native: native.Scene
    digest: str  # of the content of the file


def scene_names() -> list[str]:
    """Names of the scenes that come with the package."""
    return sorted(file.stem for file in SCENES_FOLDER.glob("*.yaml"))


def load_scene(name_or_file: str | Path) -> Scene:
    """Load a scene by name, or from a YAML file; PlancurateError says what is wrong with it."""
    file = _scene_file(name_or_file)
    content = read_yaml(file, SceneFile)
    shapes = tuple(SceneShape(entry.name, entry.to_shape()) for entry in content.shapes)
    model = native.Scene(
        ground=content.ground, margin=content.margin, **shape_arrays([shape.shape for shape in shapes])
    )
    return Scene(
        file.stem,
        shapes,
        content.ground,
        content.margin,
        model,
        hashlib.sha256(file.read_bytes()).hexdigest()[:12],
    )


def empty_scene(margin: float = 0.0) -> Scene:
    """No floor and no shapes: only the robot itself is in its way."""
    return Scene("empty", (), None, margin, native.Scene(ground=None, margin=margin, **shape_arrays([])), "")


def _scene_file(name_or_file: str | Path) -> Path:
    if str(name_or_file) in scene_names():
        return SCENES_FOLDER / f"{name_or_file}.yaml"
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
