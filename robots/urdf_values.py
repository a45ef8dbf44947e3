"""Numbers out of a URDF's attributes, with errors that say what would be right."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET

import numpy as np

from plancurate.errors import PlancurateError
from plancurate.robots.shapes import FloatArray, transform


def origin_of(where: str, element: ET.Element) -> FloatArray:
    """Transform (4,4) of the element's <origin>; the identity without one."""
    origin = element.find("origin")
    if origin is None:
        return np.eye(4)
    xyz = numbers(where, origin, "xyz", 3) if "xyz" in origin.attrib else [0.0] * 3
    rpy = numbers(where, origin, "rpy", 3) if "rpy" in origin.attrib else [0.0] * 3
    return transform(xyz, rpy)


def positive(where: str, element: ET.Element, attribute: str, count: int) -> list[float]:
    """The attribute's `count` numbers, all above zero; PlancurateError starts with `where`."""
    values = numbers(where, element, attribute, count)
    if min(values) <= 0.0:
        raise PlancurateError(
            f"{where}: {element.tag} {attribute}='{element.get(attribute)}' must be above zero"
        )
    return values


def numbers(where: str, element: ET.Element, attribute: str, count: int) -> list[float]:
    """The attribute's `count` finite numbers; PlancurateError starts with `where`."""
    text = element.get(attribute)
    if text is None:
        raise PlancurateError(f"{where}: <{element.tag}> has no {attribute}")
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        values = []
    if len(values) != count or not all(math.isfinite(value) for value in values):
        raise PlancurateError(f"{where}: {element.tag} {attribute}='{text}' must be {count} finite number(s)")
    return values
