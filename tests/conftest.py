"""Fixtures that several rooms' tests use."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from plancurate.robots import Robot, Scene
from plancurate.tasks.candidates.bullet import bullet
from plancurate.tasks.candidates.simulation import World

from .homes import new_home, shared_server, tables
from .lakes import small_lake, small_lake_once
from .robot_files import robot_folders
from .studies import maker
from .write_faults import write_faults

__all__ = [
    "maker",
    "new_home",
    "robot_folders",
    "shared_server",
    "small_lake",
    "small_lake_once",
    "tables",
    "write_faults",
]

LONGEST = (
    "integration/test_study", "flows/test_server", "integration/test_resume", "integration/test_docs",
    "integration/test_refine", "integration/test_import", "curation/selectors/test_cupid",
    "integration/test_mlflow_loss", "integration/test_all_planners", "integration/test_goals_and_references",
    "integration/test_bad_input", "integration/test_notebook",
)  # fmt: skip
SERVER_FIXTURES = {"commands", "smoke", "tables"}  # commands, a study that one ran, homes for services


def pytest_itemcollected(item: pytest.Function) -> None:
    """Mark what starts a server."""
    if SERVER_FIXTURES & set(item.fixturenames):
        item.add_marker("server")


def pytest_collection_modifyitems(items: list[pytest.Function]) -> None:
    """Begin with the files that take longest, and let one worker make the smoke study while another does without it."""
    first = {f"tests/{name}.py": place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: first.get(item.location[0], len(first)))


@pytest.fixture(scope="session", autouse=True)
def no_wait_for_the_disk() -> Iterator[None]:
    """No test cuts the power, so what this process writes need not be on the disk before it goes on."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda _: None)
        yield


class Judge:
    """PyBullet's opinion of states of one robot in one scene."""

    def __init__(self, robot: Robot, scene: Scene) -> None:
        self.world = World()
        self.world.build(robot, scene)

    def penetration(self, q: np.ndarray) -> np.ndarray:
        """How deep (b,) in m the deepest contact of each state (b,n) is; 0 where nothing touches."""
        return np.array([self._deepest(state) for state in q.tolist()])

    def penetration_on_edges(self, q: np.ndarray, step: float = 0.01) -> np.ndarray:
        """How deep the deepest contact is at the waypoints (n,dof) and at every `step` rad between them."""
        counts = np.ceil(np.abs(np.diff(q, axis=0)).max(axis=1) / step).astype(int) + 1
        edges = [np.linspace(a, b, n) for a, b, n in zip(q[:-1], q[1:], counts, strict=True)]
        return self.penetration(np.concatenate(edges))

    def _deepest(self, state: list[float]) -> float:
        world = self.world
        values = [[value] for value in state]
        bullet.resetJointStatesMultiDof(world.body, world.joints, values, physicsClientId=world.client)
        bullet.performCollisionDetection(physicsClientId=world.client)
        return max((-contact.distance for contact in world.contacts()), default=0.0)

    def tool_poses(self, q: np.ndarray, tool_link: str) -> np.ndarray:
        """Positions and quaternions (b,7) of the tool link at states (b,n)."""
        link = next(index for (_, index), name in self.world.names.items() if name == tool_link)
        return np.array([self._tool_pose(state, link) for state in q.tolist()])

    def _tool_pose(self, state: list[float], link: int) -> list[float]:
        world = self.world
        world.place(state)
        found = bullet.getLinkState(
            world.body, link, computeForwardKinematics=True, physicsClientId=world.client
        )
        return [*found[4], *found[5]]


@pytest.fixture(scope="session")
def judge() -> Callable[[Robot, Scene], Judge]:
    """PyBullet as an independent judge of collisions and poses."""
    return Judge
