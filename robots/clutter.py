"""A family of scenes: obstacles drawn from a seed, their number and size being the difficulty."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from plancurate import native
from plancurate.errors import PlancurateError
from plancurate.robots.robot import Robot
from plancurate.robots.scene import SceneShape, native_scene
from plancurate.robots.scene_file import Box, Frame, RegionEntry, Round, SceneFile, Sphere

CLUTTER = "clutter"
DIFFICULTY = r"(?::(\d{1,3})(?::(0?\.\d{1,4}))?)?"
GRAMMAR = re.compile(rf"clutter(?::(\d{{1,9}}){DIFFICULTY})?")
FAMILY_GRAMMAR = re.compile(rf"clutter:(\d{{1,9}})\.\.(\d{{1,9}}){DIFFICULTY}")
FIRST_UNSEEN = 900_000_000
"""Seeds from here on are of scenes that nobody trains in."""
MOST = 100
DRAWS = 50  # places tried for each obstacle
START_CLEARANCE = 0.04  # share of the reach that an obstacle keeps to the arm at home
INNER, OUTER = 0.4, 0.8  # how far from the shoulder's axis obstacles lie, shares of the reach
LOWEST, HIGHEST = 0.0, 0.6  # ditto above the shoulder
SECTOR = 1.2  # rad to either side of the x axis
TARGETS = {
    "left": RegionEntry(min=(0.2, 0.25, 0.0), max=(0.6, 0.6, 0.5)),
    "right": RegionEntry(min=(0.2, -0.6, 0.0), max=(0.6, -0.25, 0.5)),
}


@dataclass(frozen=True)
class ClutterParameters:
    """Which member of the family: `size` is the mean half extent of an obstacle as a share of the reach."""

    seed: int = 0
    number: int = 12
    size: float = 0.06

    @property
    def label(self) -> str:
        """The scene's name: a folder of the lake."""
        return f"{CLUTTER}-{self.seed}-{self.number}-{self.size:g}"

    @property
    def source(self) -> str:
        """What the scene is loaded by."""
        return f"{CLUTTER}:{self.seed}:{self.number}:{self.size:g}"


def parse_clutter(name: str) -> ClutterParameters:
    """Read `clutter[:SEED[:NUMBER[:SIZE]]]`; PlancurateError for anything else."""
    match = GRAMMAR.fullmatch(name)
    given = [] if match is None else [text for text in match.groups() if text is not None]
    made = ClutterParameters(*(kind(text) for kind, text in zip((int, int, float), given, strict=False)))
    if match is None or not 1 <= made.number <= MOST or not 0.01 <= made.size <= 0.3:
        raise PlancurateError(
            f"scene {name}: clutter[:SEED[:NUMBER[:SIZE]]] is needed, 1 to {MOST} obstacles with a half extent of "
            "0.01 to 0.3 reach, such as clutter:7:12:0.06"
        )
    return made


def parse_family(name: str) -> tuple[ClutterParameters, int]:
    """Read `clutter:FIRST..LAST[:NUMBER[:SIZE]]`: the first of the scenes to train in, and how many there are.

    PlancurateError for anything else.
    """
    match = FAMILY_GRAMMAR.fullmatch(name)
    if match is None or not int(match[1]) <= int(match[2]) < FIRST_UNSEEN:
        raise PlancurateError(
            f"scene {name}: clutter:FIRST..LAST[:NUMBER[:SIZE]] is needed, seeds below {FIRST_UNSEEN}, such as "
            "clutter:0..511"
        )
    first, last, *difficulty = (text for text in match.groups() if text is not None)
    return parse_clutter(":".join([CLUTTER, first, *difficulty])), int(last) - int(first) + 1


def clutter_file(parameters: ClutterParameters, robot: Robot) -> SceneFile:
    """Draw the obstacles one by one, away from the arm at home; fewer than asked for where there is no room."""
    rng = np.random.default_rng(parameters.seed)
    frame = Frame(robot.reach, robot.shoulder)
    kept: list[Box | Sphere | Round] = []
    for index in range(parameters.number):
        for _ in range(DRAWS):
            drawn = _obstacle(f"obstacle_{index}", parameters.size, rng)
            if _leaves_home_free(drawn, frame, robot):
                kept.append(drawn)
                break
    return SceneFile(ground=0.0, scale="reach", regions=TARGETS, shapes=tuple(kept))


def _obstacle(name: str, size: float, rng: np.random.Generator) -> Box | Sphere | Round:
    """A box, ball or capsule at a random place around the arm, turned at random."""
    radius, angle = rng.uniform(INNER, OUTER), rng.uniform(-SECTOR, SECTOR)
    xyz = (radius * np.cos(angle), radius * np.sin(angle), rng.uniform(LOWEST, HIGHEST))
    rpy = tuple(rng.uniform(-np.pi, np.pi, 3))
    a, b, c = rng.uniform(0.5, 1.5, 3) * size
    kind = rng.integers(3)
    if kind == 0:
        return Box(name=name, kind="box", xyz=xyz, rpy=rpy, size=(2 * a, 2 * b, 2 * c))
    if kind == 1:
        return Sphere(name=name, kind="sphere", xyz=xyz, radius=a)
    return Round(name=name, kind="capsule", xyz=xyz, rpy=rpy, radius=a / 2, length=4 * b)


def _leaves_home_free(obstacle: Box | Sphere | Round, frame: Frame, robot: Robot) -> bool:
    alone = native_scene((SceneShape(obstacle.name, obstacle.to_shape(frame)),), None, 0.0)
    nearest = native.clearance(robot.native_without_pairs, alone, robot.home[None])[0]
    return bool(nearest > START_CLEARANCE * robot.reach)
