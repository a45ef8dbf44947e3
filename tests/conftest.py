"""Fixtures that several rooms' tests use."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from plancurate.robots import Robot, Scene
from plancurate.tasks.candidates.bullet import bullet
from plancurate.tasks.candidates.simulation import World
from plancurate.tasks.lake.schema import table
from plancurate.tasks.lake.store import Lake

from .homes import new_home, tables

__all__ = ["new_home", "tables"]

SERVER_FIXTURES = {"plancurate", "tables"}  # the command line, and homes for services


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Function]) -> None:
    """Mark what starts a server, keep in one worker what shares fixtures, and begin with what takes longest."""
    for item in items:
        if SERVER_FIXTURES & set(item.fixturenames):
            item.add_marker("server")
        shared = "the smoke study" if "smoke" in item.fixturenames else item.location[0]
        item.add_marker(pytest.mark.xdist_group(shared))
    items.sort(key=lambda item: ("smoke" not in item.fixturenames, item.get_closest_marker("server") is None))


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


LINK = """
  <link name="{name}">
    <inertial><origin xyz="{com}"/><mass value="{mass}"/>
      <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial>
    <collision><origin xyz="{com}"/><geometry>{shape}</geometry></collision>
  </link>"""
JOINT = """
  <joint name="{name}" type="{type}"><parent link="{parent}"/><child link="{child}"/>
    <origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>
    <limit lower="{lower}" upper="{upper}" velocity="2" effort="150"/></joint>"""
FIXED = """
  <joint name="{name}" type="fixed"><parent link="{parent}"/><child link="{child}"/>
    <origin xyz="{xyz}" rpy="{rpy}"/></joint>"""


def seven_joint_urdf() -> str:
    """Seven joints, the last continuous, a camera fixed to the side and a tool frame without mass."""
    shapes = [
        '<capsule radius="0.06" length="0.14"/>',
        '<box size="0.1 0.1 0.24"/>',
        '<cylinder radius="0.05" length="0.2"/>',
    ]
    text = '<robot name="seven"><link name="world"/>' + LINK.format(
        name="link_0", com="0 0 0.05", mass=3, shape='<cylinder radius="0.09" length="0.1"/>'
    )
    text += FIXED.format(name="foot", parent="world", child="link_0", xyz="0 0 0", rpy="0 0 0")
    for i in range(1, 8):
        text += LINK.format(name=f"link_{i}", com="0 0 0.11", mass=8 - i, shape=shapes[i % 3])
        text += JOINT.format(
            name=f"joint_{i}",
            type="continuous" if i == 7 else "revolute",
            parent=f"link_{i - 1}",
            child=f"link_{i}",
            xyz="0 0 0.1" if i == 1 else "0 0 0.22",
            rpy="0 0 0.3" if i == 4 else "0 0 0",
            axis="0 0 1" if i % 2 else "0 1 0",
            lower=-2.8,
            upper=2.8,
        )
    text += LINK.format(name="camera", com="0 0 0", mass=0.2, shape='<sphere radius="0.04"/>')
    text += FIXED.format(name="mount", parent="link_5", child="camera", xyz="0.1 0 0.1", rpy="0 0 0")
    text += '<link name="tool"/>'
    text += FIXED.format(name="flange", parent="link_7", child="tool", xyz="0.02 0 0.15", rpy="0 0.4 0")
    return text + "</robot>"


def scara_urdf() -> str:
    """Two swinging links, a sliding spindle and a turn of two rounds."""
    text = '<robot name="scara">' + LINK.format(
        name="post", com="0 0 0.2", mass=5, shape='<box size="0.12 0.12 0.4"/>'
    )
    rows = [
        (
            "inner",
            "revolute",
            "post",
            "0 0 0.45",
            "0 0 1",
            -2.5,
            2.5,
            "0.15 0 0",
            '<box size="0.3 0.1 0.06"/>',
        ),
        (
            "outer",
            "revolute",
            "inner",
            "0.3 0 0",
            "0 0 1",
            -2.6,
            2.6,
            "0.12 0 0",
            '<box size="0.2 0.08 0.05"/>',
        ),
        (
            "spindle",
            "prismatic",
            "outer",
            "0.25 0 0",
            "0 0 -1",
            0,
            0.2,
            "0 0 0",
            '<capsule radius="0.02" length="0.2"/>',
        ),
        (
            "hand",
            "revolute",
            "spindle",
            "0 0 -0.12",
            "0 0 1",
            -6.28,
            6.28,
            "0 0 -0.02",
            '<sphere radius="0.03"/>',
        ),
    ]
    for child, kind, parent, xyz, axis, lower, upper, com, shape in rows:
        text += LINK.format(name=child, com=com, mass=1.5, shape=shape)
        text += JOINT.format(
            name=f"{child}_joint", type=kind, parent=parent, child=child, xyz=xyz, rpy="0 0 0", axis=axis,
            lower=lower, upper=upper,
        )  # fmt: skip
    return text + "</robot>"


SEVEN_YAML = """urdf: robot.urdf
tool_link: tool
scene_unchecked_links: [link_0]
allowed_contacts: [[link_4, camera], [camera, link_7]]
joints:
  joint_1: {acceleration: 3, home: 0}
  joint_2: {acceleration: 3, home: 0.6}
  joint_3: {acceleration: 3, home: 0}
  joint_4: {acceleration: 3, home: -1.0}
  joint_5: {acceleration: 3, home: 0}
  joint_6: {acceleration: 3, home: 0.7}
  joint_7: {acceleration: 3, home: 0, position: [-3.0, 3.0]}
"""
SCARA_YAML = """urdf: robot.urdf
tool_link: hand
scene_unchecked_links: [post]
joints:
  inner_joint: {acceleration: 4, home: 0.4}
  outer_joint: {acceleration: 4, home: 0.9}
  spindle_joint: {velocity: 0.5, acceleration: 2, home: 0.05}
  hand_joint: {acceleration: 8, home: 0}
"""


def write_robot(folder: Path, urdf: str, yaml: str) -> Path:
    """Write a robot's two files into a new folder."""
    folder.mkdir()
    (folder / "robot.urdf").write_text(urdf)
    (folder / "robot.yaml").write_text(yaml)
    return folder


@pytest.fixture(scope="session")
def robot_folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Folders of two robots that are unlike the H2017."""
    root = tmp_path_factory.mktemp("robots")
    return {
        "seven": write_robot(root / "seven", seven_joint_urdf(), SEVEN_YAML),
        "scara": write_robot(root / "scara", scara_urdf(), SCARA_YAML),
    }


POOL = {"robot": "h2017", "scene": "free", "pool": "0a1b2c"}
POSITIONS = [[0.5, 0.0, 0.6], [0.3, 0.2, 0.5], [0.6, -0.2, 0.7]]


def trajectory(target_id: int, planner: str, run: int, **changes: object) -> dict[str, object]:
    """A row of `trajectories` for a made-up robot of three joints that are its tool's coordinates."""
    x, y, z = POSITIONS[target_id]
    rng = np.random.default_rng([target_id, run, *planner.encode()])
    q = np.linspace([0, 0, 0], [x, y, z], 11) + np.pad(rng.normal(0, 0.1, (9, 3)), ((1, 1), (0, 0)))
    q = q.astype(np.float32).astype(np.float64)
    steps = np.diff(q, axis=0)
    return {
        "trajectory_id": f"t{target_id:04d}-{planner}-r{run}-{POOL['pool']}",
        "target_id": target_id, "run": run, "seed": 7, "status": "exact", "reason": "", "solved": True,
        "termination": "solved", "state_checks": 100, "motion_checks": 10, "goal_index": run % 2,
        "n_path_waypoints": 3, "timing_method": "spline", "target_x": x, "target_y": y, "target_z": z,
        "tool_x": q[-1, 0], "tool_y": q[-1, 1], "tool_z": q[-1, 2],
        "joint_movement": np.abs(steps).sum(),
        "smoothness": np.linalg.norm(np.diff(steps, axis=0), axis=1).sum() / 0.05**2,
        "path_length": np.linalg.norm(steps, axis=1).sum(), "duration": 0.5,
        "final_distance": np.linalg.norm(q[-1] - [x, y, z]), "n_waypoints": 11, "verified": True,
        "max_tracking_error_rad": 0.001, "final_tracking_error_m": 0.001, "contacts": 0,
        "saturated_share": 0.0, "verify_reason": "", "plan_s": 0.01, "timing_s": 0.02, "verify_s": 0.03,
        "dt": 0.05, "q": q.tolist(),
    } | changes  # fmt: skip


def failed(target_id: int, planner: str, run: int) -> dict[str, object]:
    """A row of `trajectories` of a run that found nothing."""
    nothing = dict.fromkeys(
        ("tool_x", "tool_y", "tool_z", "joint_movement", "smoothness", "path_length", "duration",
         "final_distance", "max_tracking_error_rad", "final_tracking_error_m", "contacts",
         "saturated_share", "verify_reason")
    )  # fmt: skip
    changes = {"status": "none", "reason": "no path", "solved": False, "verified": False, "q": []}
    return trajectory(target_id, planner, run, **nothing, **changes, n_waypoints=0, timing_method="")


@pytest.fixture(scope="session")
def small_lake_once(tmp_path_factory: pytest.TempPathFactory) -> Lake:
    """A lake of three targets, two planners and three runs each; one run failed, one is not verified."""
    lake = Lake(tmp_path_factory.mktemp("small") / "lake")
    targets = [
        {"target_id": i, **dict(zip("xyz", position, strict=True)), "goals": [position]}
        for i, position in enumerate(POSITIONS)
    ]
    lake.write("targets", POOL, "000000-000002", pa.Table.from_pylist(targets, table("targets").schema), {})
    for planner in ("RRT", "PRM"):
        for target_id in range(3):
            rows = [trajectory(target_id, planner, run) for run in range(3)]
            if (target_id, planner) == (1, "RRT"):
                rows[1:] = [failed(1, "RRT", 1), trajectory(1, "RRT", 2, verified=False)]
            part = pa.Table.from_pylist(rows, table("trajectories").schema)
            lake.write("trajectories", {**POOL, "planner": planner}, f"{target_id:06d}", part, {"seed": "7"})
    return lake


@pytest.fixture
def small_lake(small_lake_once: Lake, tmp_path: Path) -> Lake:
    """A copy of the small lake to write into."""
    return copied(small_lake_once, tmp_path)


def copied(lake: Lake, folder: Path) -> Lake:
    """A copy of a lake in a folder."""
    shutil.copytree(lake.root, folder / "lake")
    return Lake(folder / "lake")


NO_SECONDS = dict.fromkeys(
    ("prepare_s", "base_policy_s", "rollouts_s", "cluster_s", "score_s", "select_s", "selection_time_s"), 0.0
)


FAILURES = {
    "S": ("", ""),
    "R": ("", ""),
    "C": ("collided", "link_4 and table"),
    "L": ("limits", "joint_2 velocity"),
    ".": ("lost", ""),
}


class StudyMaker:
    """Writes made-up studies into a lake: one row in `studies`, selections, trials."""

    def __init__(self, lake: Lake) -> None:
        self.lake = lake

    def record(
        self,
        name: str,
        key: str,
        pools: Sequence[tuple[dict[str, str], str]] = ((POOL, ""),),
        **changes: object,
    ) -> str:
        """Record a study that works on these pools (partition and label); returns its identifier."""
        study = f"{name}-{key}"
        rows = [
            {
                "name": name, "study_key": key, "config": "{}", **pool, "pool_label": label,
                "planners": ["RRT", "PRM"], "n_targets": 3, "run_at": datetime(2026, 1, 1, tzinfo=UTC),
                "package_version": "0", "ompl_version": "1.5.2",
            } | changes
            for pool, label in pools
        ]  # fmt: skip
        part = pa.Table.from_pylist(rows, table("studies").schema)
        self.lake.write("studies", {"study": study}, f"{rows[0]['run_at']:%Y%m%d}", part, {})
        return study

    def plan(self, planner: str, target_id: int, key: str = "more", **changes: object) -> None:
        """Add a run of a planner to the pool, whichever study asked for it."""
        part = pa.Table.from_pylist(
            [trajectory(target_id, planner, 0) | changes], table("trajectories").schema
        )
        self.lake.write("trajectories", {**POOL, "planner": planner}, f"{target_id:06d}-{key}", part, {})

    def test(
        self,
        study: str,
        selector: str,
        budget: int | None,
        policy: str,
        outcomes: str,
        *,
        seed: int = 0,
        selection_seed: int = 0,
        kind: str = "displaced",
        pool: Mapping[str, str] = POOL,
        **changes: object,
    ) -> None:
        """Record a network's trials, one a letter and cm from its target.

        S settled, R reached, C collided with the table, L broke joint 2's velocity limit, . lost.
        """
        selection_id = f"{selector}-{budget}-{selection_seed}"
        key = f"{selector}-{budget}-{policy}-{seed}-{selection_seed}-{kind}"
        rows = [
            {
                "evaluation_id": key, "selection_id": selection_id, "selector": selector, "budget": budget,
                "selection_seed": selection_seed, "policy": policy, "seed": seed, "n_kept": 4,
                "selection_time_s": 0.5, "train_s": 1.5, "test_id": number, "kind": kind,
                "target_id": 0 if kind == "displaced" else None,
                "distance_cm": number if kind == "displaced" else None, "x": 0.0, "y": 0.0, "z": 0.0,
                "hard": False, "success": outcome in "SR", "settled": outcome == "S", "precise": outcome == "S",
                "reached": outcome in "SR", "collided": outcome == "C", "out_of_limits": outcome == "L",
                "failure": FAILURES[outcome][0], "failure_detail": FAILURES[outcome][1], "steps": 10,
                "final_distance": 0.01 * number, "settled_distance": 0.02 * number, "path_length": 1.0,
                "joint_movement": 2.0 + number,
            } | changes
            for number, outcome in enumerate(outcomes)
        ]  # fmt: skip
        part = pa.Table.from_pylist(rows, table("evaluations").schema)
        self.lake.write("evaluations", {**pool, "study": study}, key, part, {})

    def select(
        self,
        study: str,
        selector: str,
        budget: int | None,
        kept: Sequence[tuple[int, str, int]],
        *,
        seed: int = 0,
        pool: Mapping[str, str] = POOL,
        **changes: object,
    ) -> None:
        """Record a selection of the first runs of (target, planner), each with its goal configuration."""
        selection_id = f"{selector}-{budget}-{seed}"
        rows = [
            {
                "selection_id": selection_id, "selector": selector, "seed": seed, "pool_hash": "feed",
                "n_targets": 3, "params": "{}", "trajectory_id": f"t{target:04d}-{planner}-r0-{POOL['pool']}",
                "target_id": target, "planner": planner, "goal_index": goal, "n_pool": 16, "budget": budget,
                **NO_SECONDS,
            } | changes
            for target, planner, goal in kept
        ]  # fmt: skip
        part = pa.Table.from_pylist(rows, table("selections").schema)
        self.lake.write("selections", {**pool, "study": study}, selection_id, part, {})


@pytest.fixture
def maker(small_lake: Lake) -> StudyMaker:
    """Writes studies into the small lake."""
    return StudyMaker(small_lake)
