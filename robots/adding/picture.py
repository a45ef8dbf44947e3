"""A picture of a robot at home: the meshes that its shapes stand for, and the shapes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from plancurate import native
from plancurate.robots.robot import Robot
from plancurate.robots.shapes import FloatArray, Shape

if TYPE_CHECKING:
    from mpl_toolkits.mplot3d import Axes3D

MOST_TRIANGLES = 1500  # drawn of a link
VIEWS = ((20, -60), (20, 30))  # elevation and azimuth, degrees
MESH, SHAPE = "#555555", "#1f77b4"


def draw_fit(file: Path, robot: Robot, triangles: Mapping[str, FloatArray]) -> None:
    """Write a PNG of the robot at home; `triangles` (t,3,3), m, are the links' own, in their frames."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    moved = np.concatenate([np.eye(4)[None], native.joint_frames(robot.native, robot.home[None])[0]])
    meshes = [
        _placed(_thinned(found), moved[place.frame] @ place.pose)
        for link, place in robot.chain.placements.items()
        if len(found := triangles.get(link, np.empty((0, 3, 3))))
    ]
    shapes = [_placed(surface(entry.shape), moved[entry.frame]) for entry in robot.shapes]
    figure = Figure(figsize=(10, 5), layout="constrained")
    FigureCanvasAgg(figure)
    for number, (elevation, azimuth) in enumerate(VIEWS, 1):
        axes: Any = figure.add_subplot(1, 2, number, projection="3d")
        axes.view_init(elevation, azimuth)
        _draw(axes, meshes, MESH, 0.9)
        _draw(axes, shapes, SHAPE, 0.15)
        _fit_axes(axes, np.concatenate(shapes).reshape(-1, 3))
    figure.suptitle(f"{robot.name} at home: meshes (grey) inside its shapes (blue), m")
    figure.savefig(file, dpi=110)


def surface(shape: Shape) -> FloatArray:
    """Triangles (t,3,3) of a primitive."""
    import trimesh

    a, b, _ = shape.size
    if shape.kind == "box":
        mesh = trimesh.creation.box(extents=2 * np.array(shape.size))
    elif shape.kind == "sphere":
        mesh = trimesh.creation.icosphere(subdivisions=2, radius=a)
    elif shape.kind == "cylinder":
        mesh = trimesh.creation.cylinder(radius=a, height=2 * b, sections=24)
    else:
        mesh = trimesh.creation.capsule(radius=a, height=2 * b, count=[16, 16])
        mesh.apply_translation(-mesh.bounds.mean(axis=0))
    return _placed(np.asarray(mesh.triangles), shape.pose)


def _placed(triangles: FloatArray, pose: FloatArray) -> FloatArray:
    return np.asarray(triangles @ pose[:3, :3].T + pose[:3, 3])


def _thinned(triangles: FloatArray) -> FloatArray:
    """At most `MOST_TRIANGLES`, the largest: a picture needs no more."""
    if len(triangles) <= MOST_TRIANGLES:
        return triangles
    sides = triangles[:, 1:] - triangles[:, :1]
    areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    return np.asarray(triangles[areas.argsort()[-MOST_TRIANGLES:]])


def _draw(axes: Axes3D, parts: list[FloatArray], colour: str, alpha: float) -> None:
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    for part in parts:
        axes.add_collection3d(Poly3DCollection(list(part), facecolors=colour, alpha=alpha, shade=True))


def _fit_axes(axes: Any, points: FloatArray) -> None:
    """Show all points at equal scales."""
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = (low + high) / 2, np.max(high - low) / 2
    for set_limits, centre in zip((axes.set_xlim, axes.set_ylim, axes.set_zlim), middle, strict=True):
        set_limits(centre - half, centre + half)
    axes.set_box_aspect((1, 1, 1))
