"""Masses and inertias of a vendor's URDF: kept where a body can have them, else replaced, and that is said."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from plancurate.robots.adding.enclosing import volume
from plancurate.robots.adding.findings import Findings
from plancurate.robots.adding.quality import boundary
from plancurate.robots.shapes import FloatArray, Shape
from plancurate.robots.urdf_values import numbers, origin_of

DENSITY = 1000.0  # kg/m3 of a link whose mass is not given
LEAST_MASS, LEAST_SIZE = 0.01, 0.02  # kg and m of a link that has no shape either
SLACK = 1.01  # of the triangle inequality: what breaks it by less is mended
SPARE = 1e-4  # by which a mended inertia keeps it, above what is lost when it is written
SIX = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


@dataclass(frozen=True, eq=False)
class Inertial:
    """Mass, kg, centre of mass (4,4) in the link's frame, and the inertia (3,3) there, kg m2."""

    mass: float
    pose: FloatArray
    inertia: FloatArray


def read_inertial(
    name: str, link: ET.Element, shapes: Sequence[Shape], findings: Findings
) -> Inertial | None:
    """The link's inertial, repaired where no body of its mass and size can have it; None without a mass."""
    where = f"link '{name}'"
    element = link.find("inertial")
    if element is None:
        return None
    mass_element, inertia_element = element.find("mass"), element.find("inertia")
    mass = (
        0.0
        if mass_element is None
        else findings.attempt(lambda: numbers(where, mass_element, "value", 1)[0], 0.0)
    )
    if mass <= 0.0:
        return None
    pose = findings.attempt(lambda: origin_of(where, element), np.eye(4))
    inertia = np.zeros((3, 3))
    if inertia_element is not None:
        inertia = findings.attempt(lambda: _matrix(where, inertia_element), inertia)
    if (fault := _fault(mass, inertia, pose, shapes)) is None:
        return Inertial(mass, pose, _mended(inertia))
    findings.notes.append(f"{where}: its inertia {fault}; that of its mass spread over its box is taken")
    return Inertial(mass, pose, box_inertia(mass, shapes))


def guessed_inertial(name: str, shapes: Sequence[Shape], findings: Findings) -> Inertial:
    """For a link that moves and has no mass: that of water in its shapes."""
    mass = max(DENSITY * sum(volume(shape) for shape in shapes), LEAST_MASS)
    findings.notes.append(
        f"link '{name}' has no mass and physics needs one; {mass:.3g} kg is taken, its shapes' in water"
    )
    low, high = _extent(shapes)
    pose = np.eye(4)
    pose[:3, 3] = (low + high) / 2
    return Inertial(mass, pose, box_inertia(mass, shapes))


def box_inertia(mass: float, shapes: Sequence[Shape]) -> FloatArray:
    """Inertia (3,3) of a box as large as the shapes."""
    x, y, z = np.ptp(_extent(shapes), axis=0) ** 2
    return np.diag([y + z, x + z, x + y]) * mass / 12


def _extent(shapes: Sequence[Shape]) -> tuple[FloatArray, FloatArray]:
    """The corners (3,) of a box around the shapes; a small one for none."""
    if not shapes:
        return np.full(3, -LEAST_SIZE / 2), np.full(3, LEAST_SIZE / 2)
    rng = np.random.default_rng(0)
    points = np.concatenate([boundary(shape, rng, 1000) for shape in shapes])
    return points.min(axis=0), points.max(axis=0)


def _matrix(where: str, element: ET.Element) -> FloatArray:
    xx, xy, xz, yy, yz, zz = (numbers(where, element, name, 1)[0] for name in SIX)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _mended(inertia: FloatArray) -> FloatArray:
    """The nearest inertia (3,3) that keeps the triangle inequality: PyBullet takes zero for one that does not."""
    moments, axes = np.linalg.eigh(inertia)
    low, middle, high = moments
    if high <= low + middle:
        return inertia
    excess = high * (1 + SPARE) - low - middle
    return np.asarray(axes * (moments + excess / 3 * np.array([1.0, 1.0, -1.0])) @ axes.T)


def _fault(mass: float, inertia: FloatArray, pose: FloatArray, shapes: Sequence[Shape]) -> str | None:
    """What no body can have."""
    low, middle, high = np.linalg.eigvalsh(inertia)
    if low <= 0:
        return "is not positive"
    if low + middle < high / SLACK:
        return "breaks the triangle inequality"
    corners = np.array(_extent(shapes))
    reach = np.abs(corners - pose[:3, 3]).max(axis=0)
    if shapes and high > mass * (reach**2).sum():
        return "is more than its mass can have within its shapes"
    return None
