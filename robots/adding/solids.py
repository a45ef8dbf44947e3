"""What a link of a vendor's URDF is made of: primitives, which are kept, and triangles, which are to be enclosed."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from plancurate.errors import PlancurateError
from plancurate.robots.adding.findings import Findings
from plancurate.robots.adding.meshes import mesh_triangles
from plancurate.robots.adding.source import Source
from plancurate.robots.shapes import FloatArray, Shape
from plancurate.robots.urdf import read_shape
from plancurate.robots.urdf_values import origin_of


@dataclass(frozen=True, eq=False)
class Solid:
    """A link's collision geometry in its own frame: primitives and triangles (t,3,3), m."""

    shapes: tuple[Shape, ...]
    triangles: FloatArray


def read_solids(source: Source, packages: Sequence[Path], findings: Findings) -> dict[str, Solid]:
    """The solid of every link; a link that only looks like something collides as it looks, and that is said."""
    solids = {}
    for name, link in source.links.items():
        parts = link.findall("collision")
        if not parts and (parts := link.findall("visual")):
            findings.notes.append(f"link '{name}' has no <collision>; its <visual> stands for it")
        solids[name] = _solid(f"link '{name}'", parts, source.file, packages, findings)
    if not any(solid.shapes or len(solid.triangles) for solid in solids.values()) and not findings.problems:
        findings.problems.append(
            "no link has a <collision> or <visual>; without shapes nothing can be checked"
        )
    return solids


def _solid(
    where: str, parts: list[ET.Element], urdf: Path, packages: Sequence[Path], findings: Findings
) -> Solid:
    shapes: list[Shape] = []
    triangles = [np.empty((0, 3, 3))]
    for part in parts:
        mesh = part.find("geometry/mesh")
        if mesh is None:
            shapes += findings.attempt(lambda part=part: [read_shape(where, part)], [])  # type: ignore[misc]
        else:
            read = lambda part=part, mesh=mesh: _placed(where, part, mesh, urdf, packages)  # noqa: E731
            triangles.append(findings.attempt(read, np.empty((0, 3, 3))))
    return Solid(tuple(shapes), np.concatenate(triangles))


def _placed(
    where: str, part: ET.Element, mesh: ET.Element, urdf: Path, packages: Sequence[Path]
) -> FloatArray:
    """A mesh's triangles in the link's frame."""
    pose = origin_of(where, part)
    found = mesh_triangles(where, mesh, urdf, packages) @ pose[:3, :3].T + pose[:3, 3]
    if np.ptp(found.reshape(-1, 3), axis=0).max() == 0.0:
        raise PlancurateError(f"{where}: mesh '{mesh.get('filename')}' is a single point; export it again")
    return np.asarray(found)
