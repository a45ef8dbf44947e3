"""Which tool positions policies are tested on: training targets, displaced or not, and unseen ones."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene
from plancurate.tasks.candidates.settings import GenerateSettings
from plancurate.tasks.candidates.targets import Target
from plancurate.tasks.learning.reach import reach
from plancurate.tasks.learning.settings import TESTS_BY_DISTANCE

FloatArray = npt.NDArray[np.float64]
UNSEEN_SCENE: Final = "unseen_scene"
UnseenKind = Literal["unseen", "unseen_scene"]
"""Where fresh targets lie: in a scene that policies were trained in, or each in one that none was."""


@dataclass(frozen=True, eq=False)
class TargetsUnderTest:
    """t tested tool positions."""

    kind: tuple[str, ...]
    """Of each: displaced, unseen, or unseen_scene."""
    target_id: npt.NDArray[np.int32]
    distance_cm: npt.NDArray[np.int32]
    """Displacement; -1 for unseen targets."""
    position: FloatArray
    """(t, 3), m."""
    test_id: npt.NDArray[np.int32]
    """Number of each among all that were drawn."""
    hard: npt.NDArray[np.bool_] | None = None
    """Whether the straight joint line to the nearest goal is not free; None where nobody looked."""
    planned: npt.NDArray[np.bool_] | None = None
    """Whether a planner reaches it; None likewise."""

    def __len__(self) -> int:
        return len(self.kind)

    def take(self, rows: Sequence[int] | npt.NDArray[np.int64]) -> TargetsUnderTest:
        """Some of the tests, under their numbers."""
        return replace(
            self,
            kind=tuple(self.kind[i] for i in rows),
            target_id=self.target_id[rows],
            distance_cm=self.distance_cm[rows],
            position=self.position[rows],
            test_id=self.test_id[rows],
            hard=None if self.hard is None else self.hard[rows],
            planned=None if self.planned is None else self.planned[rows],
        )

    def columns(self) -> dict[str, Any]:
        """One value a test for each column of the lake's tables that says what was tested; `hard` where it is known."""
        tested = {
            "test_id": self.test_id,
            "kind": self.kind,
            "target_id": self.target_id,
            "distance_cm": pa.array(self.distance_cm, mask=self.distance_cm < 0),
            **dict(zip("xyz", self.position.T, strict=True)),
        }
        return tested if self.hard is None else tested | {"hard": self.hard}


def displaced_tests(targets: Sequence[Target], seed: int) -> TargetsUnderTest:
    """Tests of training targets: one in place and three at each of 1 to 5 cm, in random directions.

    A target's tests depend on the seed and the target alone, never on what policies are trained with.
    """
    cm = np.repeat(list(TESTS_BY_DISTANCE), list(TESTS_BY_DISTANCE.values())).astype(np.int32)
    positions = [
        target.position + cm[:, None] / 100 * directions(len(cm), seed, target.target_id)
        for target in targets
    ]
    return TargetsUnderTest(
        kind=("displaced",) * (len(cm) * len(targets)),
        target_id=np.repeat([target.target_id for target in targets], len(cm)).astype(np.int32),
        distance_cm=np.tile(cm, len(targets)),
        position=np.concatenate(positions) if positions else np.empty((0, 3)),
        test_id=np.arange(len(cm) * len(targets), dtype=np.int32),
    )


def unseen_tests(targets: Sequence[Target], kind: UnseenKind = "unseen") -> TargetsUnderTest:
    """One test at each fresh target."""
    return TargetsUnderTest(
        kind=(kind,) * len(targets),
        target_id=np.array([target.target_id for target in targets], dtype=np.int32),
        distance_cm=np.full(len(targets), -1, dtype=np.int32),
        position=np.array([target.position for target in targets]).reshape(-1, 3),
        test_id=np.arange(len(targets), dtype=np.int32),
    )


def join_tests(*parts: TargetsUnderTest) -> TargetsUnderTest:
    """All tests of several parts, in order and numbered anew."""
    return TargetsUnderTest(
        kind=tuple(kind for part in parts for kind in part.kind),
        target_id=np.concatenate([part.target_id for part in parts]),
        distance_cm=np.concatenate([part.distance_cm for part in parts]),
        position=np.concatenate([part.position for part in parts]),
        test_id=np.arange(sum(map(len, parts)), dtype=np.int32),
    )


def reachable_tests(
    tests: TargetsUnderTest, robot: Robot, scenes: Sequence[Scene], settings: GenerateSettings, seed: int
) -> TargetsUnderTest:
    """The tests under their numbers, less displaced ones that no planner reaches; marked where hard, and where planned.

    `scenes` has the one of each test. A test's goals and plan depend on its number and the seed, never on which others
    there are.
    """
    found = [
        reach(robot, scene, position, settings, (seed, int(number)))
        for scene, position, number in zip(scenes, tests.position, tests.test_id, strict=True)
    ]
    kept = [i for i, one in enumerate(found) if one.planned or tests.kind[i] != "displaced"]
    looked_at = replace(
        tests,
        hard=np.array([one.hard for one in found], dtype=bool),
        planned=np.array([one.planned for one in found], dtype=bool),
    )
    return looked_at.take(kept)


def directions(count: int, seed: int, target_id: int) -> FloatArray:
    """Unit vectors (count, 3), uniform on the sphere."""
    digest = hashlib.sha256(f"displaced/{seed}/{target_id}".encode()).digest()
    rng = np.random.default_rng(int.from_bytes(digest[:8], "little"))
    vectors = rng.normal(size=(count, 3))
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))
