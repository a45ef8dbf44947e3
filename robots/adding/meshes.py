"""Find and read the meshes that a URDF names."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from plancurate.errors import PlancurateError
from plancurate.robots.shapes import FloatArray
from plancurate.robots.urdf_values import numbers

FORMATS = (".stl", ".obj", ".dae")


def mesh_triangles(where: str, mesh: ET.Element, urdf: Path, packages: Sequence[Path]) -> FloatArray:
    """Return the triangles (t,3,3), m, of a <mesh> in its own frame; PlancurateError starts with `where`."""
    name = mesh.get("filename", "")
    scale = np.array(numbers(where, mesh, "scale", 3) if "scale" in mesh.attrib else [1.0, 1.0, 1.0])
    file = find_mesh(where, name, urdf, packages)
    if file.suffix.lower() not in FORMATS:
        raise PlancurateError(f"{where}: mesh {file}: must be one of {', '.join(FORMATS)}; convert it")
    return np.asarray(_read(where, file) * scale)


def find_mesh(where: str, name: str, urdf: Path, packages: Sequence[Path]) -> Path:
    """Return the file that a mesh's `filename` means, looked for in the packages and around the URDF."""
    places = _places(name, urdf, packages)
    for place in places:
        if place.is_file():
            return place
    package = name.removeprefix("package://").split("/")[0]
    remedy = (
        f"name the folder of the package '{package}' with --package-path"
        if name.startswith("package://")
        else "name the folder that it is relative to with --package-path"
    )
    raise PlancurateError(f"{where}: mesh '{name}' is not found beside the URDF nor above it; {remedy}")


def _places(name: str, urdf: Path, packages: Sequence[Path]) -> list[Path]:
    """Where the mesh may be, the likeliest first."""
    above = list(urdf.resolve().parents)
    if not name.startswith("package://"):
        path = Path(name.removeprefix("file://"))
        return [path] if path.is_absolute() else [folder / path for folder in (above[0], *packages)]
    package, _, rest = name.removeprefix("package://").partition("/")
    own = [folder / rest for folder in (*packages, *above) if folder.name == package]
    inside = [folder / package / rest for folder in (*packages, *above)]
    return [*own, *inside, *(folder / rest for folder in packages)]


def _read(where: str, file: Path) -> FloatArray:
    import trimesh  # 0.3 s, which only this needs

    try:
        loaded = trimesh.load_scene(file, process=False, skip_materials=True)
        triangles = np.asarray(loaded.to_mesh().triangles, dtype=np.float64)
    except Exception as error:
        raise PlancurateError(f"{where}: mesh {file}: can't be read ({error}); export it again") from None
    if not len(triangles) or not np.isfinite(triangles).all():
        raise PlancurateError(
            f"{where}: mesh {file}: holds no triangles, or numbers that are not finite; export it again"
        )
    return triangles * (_dae_unit(file) if file.suffix.lower() == ".dae" else 1.0)


def _dae_unit(file: Path) -> float:
    """Metres of a COLLADA file's unit."""
    unit = re.search(rb'<unit[^>]*\smeter="([^"]+)"', file.read_bytes()[:20_000])
    return float(unit.group(1)) if unit else 1.0
