"""Which columns of a data set are a robot's joints."""

from __future__ import annotations

from collections.abc import Sequence

from plancurate.errors import PlancurateError
from plancurate.robots.robot import Robot


def joint_columns(where: str, names: Sequence[str], width: int, robot: Robot) -> list[int]:
    """Places of the robot's joints among so many columns: by name, or all in order where no name is a joint's.

    PlancurateError where a joint is missing, or nameless columns are not as many as the robot's joints.
    """
    found = [name for name in robot.joint_names if name in names]
    if not found and width == robot.dof:
        return list(range(width))
    if missing := [name for name in robot.joint_names if name not in found]:
        there = ", ".join(names) or f"{width} columns without names"
        raise PlancurateError(
            f"{where}: no joint {missing[0]} of robot {robot.name} ({robot.dof} joints) among {there}"
        )
    return [names.index(name) for name in robot.joint_names]
