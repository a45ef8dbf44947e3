"""What a picture or film shows: an arm in a scene, the motions it makes one after another, lines and targets."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from plancurate import native
from plancurate.robots import Robot, Scene, colliding_pairs
from plancurate.robots.shapes import FloatArray
from plancurate.tasks.motion.motion import Motion, curve_of
from plancurate.tasks.pictures.drawing import Dot, Line
from plancurate.tasks.pictures.solids import tool_path

GOOD, BAD, TARGET = "#1a7f37", "#e0261c", "#d6006c"
COLOURS = ("#1f77b4", "#e6700a", "#2ca02c", "#9467bd", "#17a2b8", "#b8860b", "#d62780", "#5b6770")
STATES = 400  # of a motion that are looked at for a collision


@dataclass(frozen=True, eq=False)
class Run:
    """One motion: times (k,), s, from 0, and joint positions (k, n), rad; how it ends in words."""

    times: FloatArray
    states: FloatArray
    colour: str = COLOURS[0]
    said: str = ""
    target: FloatArray | None = None
    """(3,), m, where the tool is to go."""
    touching: frozenset[str] = frozenset()
    """Links and obstacles that touch at the end: where the motion can't go on."""

    def state(self, time: float) -> FloatArray:
        """Joint positions (n,) then; before the beginning and after the end the arm rests."""
        return np.array([np.interp(time, self.times, column) for column in self.states.T])

    def until(self, time: float) -> FloatArray:
        """Joint positions (k, n) on the way up to then."""
        return np.concatenate([self.states[self.times < time], self.state(time)[None]])


@dataclass(frozen=True, eq=False)
class Shot:
    """An arm in a scene. Without runs it rests at home."""

    robot: Robot
    scene: Scene
    runs: tuple[Run, ...] = ()
    lines: tuple[Line, ...] = ()
    """Tool paths that are there all the time."""
    dots: tuple[Dot, ...] = ()
    title: str = ""

    @property
    def states(self) -> FloatArray:
        """Every state that is shown (k, n), home first."""
        return np.concatenate([self.robot.home[None], *(run.states for run in self.runs)])


def motion_run(robot: Robot, scene: Scene, motion: Motion, colour: str = "") -> Run:
    """A motion as the robot follows it, up to where it touches something first."""
    curve = curve_of(motion)
    times = np.linspace(curve.start, curve.end, STATES)
    states = curve.position(times)
    free = native.is_free(robot.native, scene.native, np.ascontiguousarray(states))
    if free.all():
        said = f"free of collision, {curve.end - curve.start:.2f} s"
        return Run(times - curve.start, states, colour or GOOD, said)
    first = int((~free).argmax())
    touching = colliding_pairs(robot, scene, states[first])
    said = f"collides after {times[first] - curve.start:.2f} s: {', '.join(touching)}"
    until = slice(max(first, 1) + 1)
    return Run(times[until] - curve.start, states[until], BAD, said, touching=names_in(touching))


def names_in(pairs: Sequence[str]) -> frozenset[str]:
    """The names in "link_4 and table" and the like."""
    return frozenset(name for pair in pairs for name in pair.split(" and "))


def run_marks(robot: Robot, run: Run, time: float) -> tuple[list[Line], list[Dot]]:
    """The tool's path up to a time and the target of a run."""
    lines = [Line(tool_path(robot, run.until(time)), run.colour, 3.0)]
    dots = [] if run.target is None else [Dot(run.target, TARGET, 7.0, ring=True)]
    return lines, dots


def thinned(states: FloatArray, count: int) -> Iterator[FloatArray]:
    """At most so many of the states (k, n), evenly, the first and the last among them."""
    yield from states[np.unique(np.linspace(0, len(states) - 1, count).astype(int))]
