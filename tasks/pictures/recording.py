"""Shots as a recording for the Rerun viewer: shapes, tool paths, targets, joint curves (extra `viz`)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import rerun as rr

from plancurate import native
from plancurate.robots import Robot
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.pictures.light import colour
from plancurate.tasks.pictures.shot import TARGET, Run, Shot
from plancurate.tasks.pictures.solids import COLLISION, Solid, arm_solids, scene_solids, tool_path

TIME = "time"
BETWEEN_S = 0.5  # rest after each run


def write_recording(file: Path, shots: Sequence[Shot]) -> None:
    """Write an .rrd file; several shots are beside each other in its tree."""
    stream = rr.RecordingStream("plancurate", recording_id=None)
    stream.save(file)
    for number, shot in enumerate(shots):
        record_shot(stream, f"shot_{number}" if len(shots) > 1 else "world", shot)
    stream.flush()
    stream.disconnect()


def record_shot(stream: rr.RecordingStream, root: str, shot: Shot) -> None:
    """Write what rests, then each run in turn."""
    stream.log(root, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for solid in scene_solids(shot.scene):
        record_solid(stream, f"{root}/scene/{solid.name}", solid)
    for number, line in enumerate(shot.lines):
        strip = rr.LineStrips3D([line.points], colors=[rgb(line.colour)])
        stream.log(f"{root}/tool_paths/{number}", strip, static=True)
    if shot.dots:
        points = rr.Points3D(
            [dot.at for dot in shot.dots], colors=[rgb(dot.colour) for dot in shot.dots], radii=0.01
        )
        stream.log(f"{root}/targets", points, static=True)
    record_arm(stream, root, shot.robot)
    start = 0.0
    for number, run in enumerate(shot.runs):
        record_run(stream, root, shot.robot, run, number, start)
        start += float(run.times[-1]) + BETWEEN_S


def record_arm(stream: rr.RecordingStream, root: str, robot: Robot) -> None:
    """The arm's shapes, each in the frame that it moves with, and these frames at home."""
    colours = [solid.colour for solid in arm_solids(robot, robot.home)]
    for number, (entry, tint) in enumerate(zip(robot.shapes, colours, strict=True)):
        path = f"{root}/arm/frame_{entry.frame}/{entry.link}_{number}"
        record_solid(stream, path, Solid(entry.link, entry.shape, tint))
    record_state(stream, root, robot, robot.home)


def record_run(
    stream: rr.RecordingStream, root: str, robot: Robot, run: Run, number: int, start: float
) -> None:
    """A run's joint positions, frames, tool path and target over time."""
    stream.set_time(TIME, duration=start)
    path = rr.LineStrips3D([tool_path(robot, run.states)], colors=[rgb(run.colour)])
    stream.log(f"{root}/tool_paths/run_{number}", path)
    if run.target is not None:
        stream.log(f"{root}/target", rr.Points3D([run.target], colors=[rgb(TARGET)], radii=0.015))
    for time, q in zip(run.times, run.states, strict=True):
        stream.set_time(TIME, duration=start + float(time))
        record_state(stream, root, robot, q)
        for name, value in zip(robot.joint_names, q, strict=True):
            stream.log(f"joints/{root}/{name}", rr.Scalars(float(value)))
    if run.said:
        stream.log(f"{root}/said", rr.TextLog(run.said))
    if run.touching:
        ended = [solid for solid in arm_solids(robot, run.states[-1]) if solid.name in run.touching]
        points = rr.Points3D(
            [solid.shape.pose[:3, 3] for solid in ended], colors=[rgb(COLLISION)], radii=0.03
        )
        stream.log(f"{root}/collision", points)


def record_state(stream: rr.RecordingStream, root: str, robot: Robot, q: FloatArray) -> None:
    """The frames that move with the joints."""
    for number, frame in enumerate(native.joint_frames(robot.native, q[None])[0], start=1):
        pose = rr.Transform3D(translation=frame[:3, 3], mat3x3=frame[:3, :3])
        stream.log(f"{root}/arm/frame_{number}", pose)


def record_solid(stream: rr.RecordingStream, path: str, solid: Solid) -> None:
    """A shape, posed in the frame above it."""
    shape, tints = solid.shape, [rgb(solid.colour)]
    a, b, c = shape.size
    turn = rr.Transform3D(translation=shape.pose[:3, 3], mat3x3=shape.pose[:3, :3])
    stream.log(path, turn, static=True)
    drawn: Iterable[object] = {
        "box": lambda: rr.Boxes3D(half_sizes=[[a, b, c]], colors=tints, fill_mode="solid"),
        "sphere": lambda: rr.Ellipsoids3D(half_sizes=[[a, a, a]], colors=tints, fill_mode="solid"),
        "cylinder": lambda: rr.Cylinders3D(lengths=[2 * b], radii=[a], colors=tints, fill_mode="solid"),
        "capsule": lambda: rr.Capsules3D(
            lengths=[2 * b], radii=[a], translations=[[0, 0, -b]], colors=tints, fill_mode="solid"
        ),
    }[shape.kind]()
    stream.log(path, drawn, static=True)


def rgb(hexadecimal: str) -> list[int]:
    """Red, green and blue, 0 to 255."""
    return [round(part) for part in (255 * colour(hexadecimal)).tolist()]
