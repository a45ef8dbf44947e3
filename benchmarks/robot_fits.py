"""How conservative, and how tight, a robot's primitives are: Coal on the vendor's meshes is the judge.

    python benchmarks/robot_fits.py                     the shipped arms whose meshes come with PyBullet
    python benchmarks/robot_fits.py my_arm --urdf .../my_arm.urdf [--package-path DIR ...] [--states 20000]

Random states within the planning limits, the robot against itself. Neighbours in the chain are not looked at, as in
plancurate; pairs that robot.yaml allows are. Prints the states that are free for the primitives and collide for the
meshes, of which there must be none, and the share of mesh-free states that the primitives lose.
"""

from __future__ import annotations

import argparse
import time
from itertools import combinations
from pathlib import Path

import coal
import numpy as np
import pybullet_data

from plancurate import native
from plancurate.robots import Robot, load_robot
from plancurate.robots.adding.findings import Findings
from plancurate.robots.adding.solids import Solid, read_solids
from plancurate.robots.adding.source import read_source
from plancurate.robots.scene import empty_scene

MESHES = Path(pybullet_data.getDataPath())
SHIPPED = {"panda": MESHES / "franka_panda" / "panda.urdf", "xarm6": MESHES / "xarm" / "xarm6_robot.urdf"}
SEED = 7


def main() -> None:
    """Read the command line, measure, print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("robot", nargs="?")
    parser.add_argument("--urdf", type=Path)
    parser.add_argument("--package-path", type=Path, nargs="*", default=[])
    parser.add_argument("--states", type=int, default=2000)
    given = parser.parse_args()
    if (given.robot is None) != (given.urdf is None):
        parser.error("a robot is compared with the URDF that it was made of: name both, or neither")
    asked = SHIPPED if given.robot is None else {given.robot: given.urdf}
    for name, urdf in asked.items():
        compare(load_robot(name), solids(urdf, given.package_path), given.states)


def compare(robot: Robot, meshes: dict[str, Solid], count: int) -> None:
    """Let both judge the same states, and print where they differ."""
    states = np.random.default_rng(SEED).uniform(robot.lower, robot.upper, (count, robot.dof))
    free = native.is_free(robot.native, empty_scene().native, states)
    began = time.perf_counter()
    found, pairs = Judge(robot, meshes).collide(states)
    missed, lost = free & found, ~free & ~found
    print(f"{robot.name}: {count} states, {time.perf_counter() - began:.0f} s of Coal")
    print(f"collide for the meshes: {found.mean():.2%}; free for them: {(~found).sum()}")
    some = [pairs[index] for index in np.flatnonzero(missed)[:9]]
    print(f"free for the primitives, colliding for the meshes: {missed.sum()} {some}")
    print(f"free for the meshes and lost: {lost.sum()} ({lost.sum() / max((~found).sum(), 1):.2%})")


def solids(urdf: Path, packages: list[Path]) -> dict[str, Solid]:
    """The vendor's geometry by link."""
    findings = Findings()
    found = read_solids(read_source(urdf, findings), packages, findings)
    findings.stop_at_problems(urdf)
    return found


class Judge:
    """Coal's opinion of a robot's states, by the meshes of its links."""

    def __init__(self, robot: Robot, solids: dict[str, Solid]) -> None:
        self.robot = robot
        self.parts = [
            (link, place.frame, part)
            for link, place in robot.chain.placements.items()
            for part in parts_of(solids[link], place.pose)
        ]
        self.pairs = [
            (a, b)
            for a, b in combinations(range(len(self.parts)), 2)
            if abs(self.parts[a][1] - self.parts[b][1]) > 1
        ]

    def collide(self, states: np.ndarray) -> tuple[np.ndarray, list[str]]:
        """Which states (b,n) collide, and the first pair of links that does in each."""
        frames = native.joint_frames(self.robot.native, states)
        first = [self._collides(frames[index]) for index in range(len(states))]
        return np.array([bool(name) for name in first]), first

    def _collides(self, frames: np.ndarray) -> str:
        moved = [coal.Transform3s(), *(coal.Transform3s(pose[:3, :3], pose[:3, 3]) for pose in frames)]
        objects = [coal.CollisionObject(part, moved[frame]) for _, frame, part in self.parts]
        request = coal.CollisionRequest()
        for a, b in self.pairs:
            if not objects[a].getAABB().overlap(objects[b].getAABB()):
                continue
            if coal.collide(objects[a], objects[b], request, coal.CollisionResult()):
                return f"{self.parts[a][0]} and {self.parts[b][0]}"
        return ""


def parts_of(solid: Solid, pose: np.ndarray) -> list[coal.CollisionGeometry]:
    """Coal's geometries of a link, as meshes in its moving frame."""
    from plancurate.robots.adding.picture import surface

    found = [surface(shape) for shape in solid.shapes] + ([solid.triangles] if len(solid.triangles) else [])
    return [mesh(triangles @ pose[:3, :3].T + pose[:3, 3]) for triangles in found]


def mesh(triangles: np.ndarray) -> coal.BVHModelOBBRSS:
    """A triangle soup (t,3,3) as Coal's mesh."""
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(triangles), 3 * len(triangles))
    points = triangles.reshape(-1, 3)
    corners = coal.StdVec_Triangle() if hasattr(coal, "StdVec_Triangle") else coal.StdVec_Triangle32()
    for index in range(len(triangles)):
        corners.append(coal.Triangle(3 * index, 3 * index + 1, 3 * index + 2))
    model.addSubModel(points_of(points), corners)
    model.endModel()
    model.computeLocalAABB()
    return model


def points_of(points: np.ndarray) -> coal.StdVec_Vec3s:
    """Points (n,3) as Coal's vector."""
    found = coal.StdVec_Vec3s()
    found.extend(list(points))
    return found


if __name__ == "__main__":
    main()
