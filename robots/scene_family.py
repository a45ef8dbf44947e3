"""Scenes that are drawn alike: some to train in, and others, never trained in, to test in."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from functools import lru_cache

from plancurate.robots.clutter import CLUTTER, FIRST_UNSEEN, ClutterParameters, parse_family
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene, native_scene
from plancurate.robots.scene_loading import load_scene


@dataclass(frozen=True, eq=False)
class SceneFamily:
    """A family of scenes for one robot; which of them a target lies in follows from its number."""

    shared: Scene
    """What all have in common, floor and regions: a scene without obstacles."""
    robot: Robot
    first: ClutterParameters
    """Of the scenes to train in."""
    count: int
    """How many there are to train in."""

    def training(self, target_id: int) -> str:
        """What the scene of a training target is loaded by: targets go round the scenes."""
        return replace(self.first, seed=self.first.seed + target_id % self.count).source

    def unseen(self, test: int) -> str:
        """What the scene of a test is loaded by: each has one of its own, which no target is trained in."""
        return replace(self.first, seed=FIRST_UNSEEN + test).source

    def member(self, source: str) -> Scene:
        """The scene loaded by what `training` and `unseen` give."""
        return _member(self.robot, source)


def is_family(name: str) -> bool:
    """Whether a scene's name means many: `clutter:FIRST..LAST`."""
    return name.startswith(f"{CLUTTER}:") and ".." in name


def load_family(name: str, robot: Robot) -> SceneFamily:
    """Load the family `clutter:FIRST..LAST[:NUMBER[:SIZE]]` for a robot; PlancurateError for anything else."""
    first, count = parse_family(name)
    scene = load_scene(first.source, robot)
    label = f"{CLUTTER}-{first.seed}-to-{first.seed + count - 1}-{first.number}-{first.size:g}"
    digest = hashlib.sha256(f"{label} {scene.digest}".encode()).hexdigest()[:12]
    bare = native_scene((), scene.ground, scene.margin)
    return SceneFamily(replace(scene, name=label, shapes=(), native=bare, digest=digest), robot, first, count)


@lru_cache(maxsize=4096)  # drawing the obstacles takes longer than what a task does with one target
def _member(robot: Robot, source: str) -> Scene:
    return load_scene(source, robot)
