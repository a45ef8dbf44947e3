"""ROS's trajectory_msgs/JointTrajectory, in YAML as its command line prints it, or in JSON, which YAML includes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from plancurate.errors import PlancurateError, field_of, first_problem
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.motion.motion import Motion
from plancurate.yaml_files import read_yaml

AROUND = (
    "trajectory",
    "joint_trajectory",
)  # messages that hold one: goals of actions, MoveIt's RobotTrajectory


class Duration(BaseModel):
    """builtin_interfaces/Duration of ROS 2, or the duration of ROS 1."""

    model_config = ConfigDict(extra="forbid")

    sec: int = 0
    nanosec: int = 0
    secs: int = 0
    nsecs: int = 0

    @property
    def seconds(self) -> float:
        """The time, s."""
        return self.sec + self.secs + (self.nanosec + self.nsecs) / 1e9


class Point(BaseModel):
    """trajectory_msgs/JointTrajectoryPoint; `effort` is not used."""

    positions: list[float]
    velocities: list[float] = []
    accelerations: list[float] = []
    time_from_start: Duration | float


class JointTrajectory(BaseModel):
    """trajectory_msgs/JointTrajectory; `header` is not used."""

    joint_names: list[str]
    points: list[Point] = Field(min_length=1)


def read_ros(file: Path) -> Motion:
    """Read a trajectory; PlancurateError for a file that holds something else."""
    content = read_json(file) if file.suffix.lower() == ".json" else read_yaml(file)
    for name in AROUND:
        if isinstance(content, dict) and isinstance(content.get(name), dict):
            content = content[name]
    try:
        message = JointTrajectory.model_validate(content)
    except ValidationError as error:
        raise PlancurateError(first_problem(f"{file}: {field_of(error)}", error, JointTrajectory)) from None
    times = [
        point.time_from_start if isinstance(point.time_from_start, float) else point.time_from_start.seconds
        for point in message.points
    ]
    return Motion(
        np.array(times),
        rows(file, message, "positions"),
        rows(file, message, "velocities") if message.points[0].velocities else None,
        rows(file, message, "accelerations") if message.points[0].accelerations else None,
        tuple(message.joint_names),
    )


def read_json(file: Path) -> Any:
    """What a JSON file holds."""
    try:
        return json.loads(file.read_text(encoding="utf-8"))
    except (UnicodeDecodeError, ValueError, RecursionError) as error:
        raise PlancurateError(f"{file}: not valid JSON: {error}") from None


def rows(file: Path, message: JointTrajectory, field: str) -> FloatArray:
    """One kind of value of all points (m, n)."""
    values = [getattr(point, field) for point in message.points]
    for number, value in enumerate(values):
        if len(value) != len(message.joint_names):
            raise PlancurateError(
                f"{file}: points.{number}.{field} has {len(value)} values; one for each of the "
                f"{len(message.joint_names)} joint_names would be right"
            )
    return np.array(values)


def write_ros(file: Path, motion: Motion) -> None:
    """Write a trajectory as ROS 2 has it."""
    message = {
        "joint_names": list(motion.joint_names or ()),
        "points": [point(motion, i) for i in range(len(motion.times))],
    }
    if file.suffix.lower() == ".json":
        file.write_text(json.dumps(message, indent=1) + "\n")
    else:
        file.write_text(yaml.safe_dump(message, sort_keys=False, default_flow_style=None))


def point(motion: Motion, sample: int) -> dict[str, Any]:
    """One sample as a JointTrajectoryPoint."""
    kinds = ("positions", "velocities", "accelerations")
    values = {kind: getattr(motion, kind) for kind in kinds}
    sec, nanosec = divmod(round(float(motion.times[sample]) * 1e9), 10**9)
    listed = {kind: value[sample].tolist() for kind, value in values.items() if value is not None}
    return {**listed, "time_from_start": {"sec": sec, "nanosec": nanosec}}
